#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "cloud/points.hpp"
#include "diagnosis/eigenvalues.hpp"
#include "diagnosis/matrix.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spectrum.hpp"
#include "matrix/checks.hpp"

namespace gradpsi {
namespace {

/// The rows and columns of A that count, those of points that evolve, where they are in A: a copy of them
/// would take longer than all else here.
struct Part {
  const Cloud& cloud;
  const SparseMatrix& A;
  const std::vector<int>& points;
  std::vector<char> evolves;  // for each of all points
};

Part part(const Cloud& cloud, const SparseMatrix& A, const std::vector<int>& points) {
  Part result{cloud, A, points, std::vector<char>(cloud.size(), false)};
  for (int k = 0; k < std::ssize(points); ++k) {
    if (points[k] < 0 || points[k] >= cloud.size() || (k > 0 && points[k] <= points[k - 1]))
      throw InvalidInput("point " + std::to_string(points[k]) + " is not one of " +
                         std::to_string(cloud.size()) + ", or not above the one before it");
    result.evolves[points[k]] = true;
  }
  return result;
}

/// A row's Gershgorin disc.
struct Disc {
  int point;
  double centre, radius;
  double reach() const { return centre + radius; }  // to the right
  /// In units of |a_ii|.
  double relative() const {
    return centre == 0 ? (radius > 0 ? std::numeric_limits<double>::infinity() : 0)
                       : reach() / std::abs(centre);
  }
  /// Whether it is on the left, up to rounding.
  bool is_left() const { return reach() <= 1e-12 * std::abs(centre); }
};

std::vector<Disc> discs(const Part& part) {
  std::vector<Disc> result;
  result.reserve(part.points.size());
  for (const int i : part.points) {
    Disc disc{i, 0, 0};
    for (SparseMatrix::InnerIterator a(part.A, i); a; ++a)
      if (a.col() == i)
        disc.centre = a.value();
      else if (part.evolves[a.col()])
        disc.radius += std::abs(a.value());
    result.push_back(disc);
  }
  return result;
}

/// Whether a positive diagonal S moves the discs of S^-1 A S to the left. Rows at held boundaries have
/// something to spare; each sweep passes it on by one row, so this is for clouds some ten rows deep.
bool is_left_when_scaled(const Part& part, const std::vector<Disc>& discs) {
  constexpr int sweeps = 10;
  if (std::ranges::any_of(discs, [](const Disc& d) { return d.centre >= 0 && !d.is_left(); }))
    return false;
  DenseVector scale = DenseVector::Ones(part.cloud.size()), next = scale;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    bool left = true;
    for (const Disc& d : discs) {
      double radius = 0;
      for (SparseMatrix::InnerIterator a(part.A, d.point); a; ++a)
        if (a.col() != d.point && part.evolves[a.col()])
          radius += std::abs(a.value()) * scale[a.col()];
      left &= radius <= (1 + 1e-12) * -d.centre * scale[d.point];
      if (d.centre < 0)
        next[d.point] = std::min(scale[d.point], (scale[d.point] + radius / -d.centre) / 2);
    }
    if (left) return true;
    scale = next;
  }
  return false;
}

constexpr int few_points = 10'000;  // that scaling may help

/// Point i and, of those that evolve and are connected with it over a few steps, the nearest ones, `count`
/// in all, ascending.
std::vector<int> nearest_in_matrix(const Part& part, int i, int count) {
  std::vector<int> found = {i};
  std::set<int> seen = {i};
  for (std::size_t k = 0; k < found.size() && std::ssize(found) < 3 * count; ++k)
    for (SparseMatrix::InnerIterator a(part.A, found[k]); a; ++a)
      if (const int j = static_cast<int>(a.col()); part.evolves[j] && seen.insert(j).second)
        found.push_back(j);
  const auto distance = [&](int j) {
    return dispatch(part.cloud.dimension(), [&](auto d) {
      return displacement<decltype(d)::value>(part.cloud, i, j).norm();
    });
  };
  std::ranges::stable_sort(found, {}, distance);
  found.resize(std::min<std::size_t>(found.size(), count));
  std::ranges::sort(found);
  return found;
}

/// Rows and columns of some points of a large matrix.
SparseMatrix block(const SparseMatrix& A, const std::vector<int>& points) {
  const auto m = std::ssize(points);
  SparseMatrix result(m, m);
  for (int k = 0; k < m; ++k) {
    result.startVec(k);
    for (SparseMatrix::InnerIterator a(A, points[k]); a; ++a)
      if (const auto place = std::ranges::lower_bound(points, static_cast<int>(a.col()));
          place != points.end() && *place == a.col())
        result.insertBack(k, place - points.begin()) = a.value();
  }
  result.finalize();
  return result;
}

/// What the eigenvalues of the rows and columns around a point say.
struct Look {
  int point;
  std::vector<int> block;
  double rate;  // the largest real part
};

Look look(const Part& part, int point, int size) {
  Look result{point, nearest_in_matrix(part, point, size), 0};
  result.rate = eigenvalues(block(part.A, result.block)).real().maxCoeff();
  return result;
}

/// Points whose discs reach furthest to the right, and those whose discs do so in units of |a_ii|, where
/// spacings vary; of the latter more, since there are more kinds of them.
struct Suspects {
  std::vector<int> all, foremost;
};

Suspects suspects(std::vector<Disc> discs) {
  constexpr int furthest = 9, foremost = 2;
  Suspects result;
  const auto add = [&](auto by, int count) {
    const auto end = discs.begin() + std::min<std::ptrdiff_t>(std::ssize(discs), count);
    std::ranges::partial_sort(discs, end, [&](const Disc& a, const Disc& b) {
      return (a.*by)() != (b.*by)() ? (a.*by)() > (b.*by)() : a.point < b.point;
    });
    for (auto disc = discs.begin(); disc != end; ++disc) {
      if (disc - discs.begin() < foremost) result.foremost.push_back(disc->point);
      if (std::ranges::find(result.all, disc->point) == result.all.end())
        result.all.push_back(disc->point);
    }
  };
  add(&Disc::reach, furthest);
  add(&Disc::relative, 2 * furthest);
  return result;
}

/// Looks at small blocks around all suspects, then at larger ones around those where growth is fastest or
/// decay slowest, and around the foremost suspects: what grows in a small block may be held by what
/// surrounds it, and the other way round. A larger one holds a long row's neighbours and some more. The first
/// that grows by more than `zero` is enough.
Look fastest(const Part& part, const Suspects& suspects, double zero) {
  constexpr int small = 30, large = 120, looked_at_again = 4;
  std::vector<Look> looks;
  for (const int point : suspects.all) looks.push_back(look(part, point, small));
  std::ranges::stable_sort(looks, {}, [](const Look& l) { return -l.rate; });
  looks.resize(std::min<std::size_t>(looks.size(), looked_at_again));
  std::vector<int> again;
  for (const Look& l : looks) again.push_back(l.point);
  for (const int point : suspects.foremost)
    if (std::ranges::find(again, point) == again.end()) again.push_back(point);
  Look result{-1, {}, -std::numeric_limits<double>::infinity()};
  for (const int point : again) {
    const auto row = part.A.outerIndexPtr()[point + 1] - part.A.outerIndexPtr()[point];
    Look larger = look(part, point, std::max(large, static_cast<int>(3 * row / 2)));
    if (larger.rate > result.rate) result = std::move(larger);
    if (result.rate > zero) break;
  }
  return result;
}

/// Whether, by Cauchy's interlacing, the whole grows no slower than a block: if both are symmetric.
bool holds_for_the_whole(const Part& part, const Look& look, const VectorView& volumes) {
  return is_symmetric(block(part.A, look.block), volumes(look.block)) &&
         is_symmetric(principal_part(part.A, part.points), volumes(part.points));
}

}  // namespace

Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const VectorView& volumes) {
  if (laplacian.rows() != cloud.size() || laplacian.cols() != cloud.size() ||
      volumes.size() != cloud.size())
    throw InvalidInput("the matrix is not one of all " + std::to_string(cloud.size()) + " points");
  const Part evolving = part(cloud, laplacian, points);
  const std::vector<Disc> all = discs(evolving);
  if (std::ranges::all_of(all, &Disc::is_left)) return {.certain = true};
  if (std::ssize(points) <= few_points && is_left_when_scaled(evolving, all))
    return {.certain = true};

  DenseVector diagonal(std::ssize(all));
  for (std::size_t k = 0; k < all.size(); ++k)
    diagonal[static_cast<Eigen::Index>(k)] = all[k].centre;
  const double zero = slow_growth * median_diagonal(diagonal);
  const Look found = fastest(evolving, suspects(all), zero);
  const bool whole = found.block.size() == points.size();
  // A block's fastest mode is a bit slower than that of the whole.
  Forecast result{.grows = found.rate > (whole ? 1 : 0.5) * zero};
  result.rate = found.rate;
  if (result.grows) result.point = found.point;
  result.certain = whole || (found.rate > zero && holds_for_the_whole(evolving, found, volumes));
  return result;
}

}  // namespace gradpsi
