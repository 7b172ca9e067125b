#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
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

/// Row i and, of those it is connected with over a few steps, the nearest ones, `count` in all.
std::vector<int> nearest_in_matrix(const Cloud& cloud, const SparseMatrix& A,
                                   const std::vector<int>& points, int i, int count) {
  std::vector<int> found = {i};
  std::set<int> seen = {i};
  for (std::size_t k = 0; k < found.size() && std::ssize(found) < 3 * count; ++k)
    for (SparseMatrix::InnerIterator a(A, found[k]); a; ++a)
      if (seen.insert(static_cast<int>(a.col())).second) found.push_back(static_cast<int>(a.col()));
  const auto distance = [&](int j) {
    return dispatch(cloud.dimension(), [&](auto d) {
      return displacement<decltype(d)::value>(cloud, points[i], points[j]).norm();
    });
  };
  std::ranges::stable_sort(found, {}, distance);
  found.resize(std::min<std::size_t>(found.size(), count));
  std::ranges::sort(found);
  return found;
}

constexpr int looked_at = 9, block = 30;

/// The rows whose Gershgorin discs reach furthest to the right, and those whose discs do so in units of
/// |a_ii|, where spacings vary; of the latter more, since there are more kinds of them.
std::vector<int> suspects(const SparseMatrix& A) {
  const int n = static_cast<int>(A.rows());
  std::vector<double> reach(n), relative(n);
  for (int i = 0; i < n; ++i) {
    double diagonal = 0;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      reach[i] += a.col() == i ? a.value() : std::abs(a.value());
      if (a.col() == i) diagonal = std::abs(a.value());
    }
    relative[i] = diagonal > 0 ? reach[i] / diagonal : 0;
  }
  std::vector<int> result;
  const auto add_furthest = [&](const std::vector<double>& by, int count) {
    std::vector<int> rows(n);
    std::iota(rows.begin(), rows.end(), 0);
    const auto end = rows.begin() + std::min(n, count);
    std::partial_sort(rows.begin(), end, rows.end(),
                      [&](int i, int j) { return by[i] != by[j] ? by[i] > by[j] : i < j; });
    for (auto row = rows.begin(); row != end; ++row)
      if (std::ranges::find(result, *row) == result.end()) result.push_back(*row);
  };
  add_furthest(reach, looked_at);
  add_furthest(relative, 2 * looked_at);
  return result;
}

}  // namespace

Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const VectorView& volumes) {
  if (laplacian.rows() != cloud.size() || laplacian.cols() != cloud.size() ||
      volumes.size() != cloud.size())
    throw InvalidInput("the matrix is not one of all " + std::to_string(cloud.size()) + " points");
  const SparseMatrix A = principal_part(laplacian, points);
  if (is_dominant(-A)) return {.certain = true};

  Forecast result;
  for (const int i : suspects(A)) {
    const auto near = nearest_in_matrix(cloud, A, points, i, block);
    const double rate = eigenvalues(principal_part(A, near)).real().maxCoeff();
    if (result.point < 0 || rate > result.rate) result.rate = rate, result.point = points[i];
  }
  result.grows = result.rate > slow_growth * median_diagonal(A);
  result.certain = result.grows && is_symmetric(A, volumes(points));
  if (!result.grows) result.point = -1;
  return result;
}

}  // namespace gradpsi
