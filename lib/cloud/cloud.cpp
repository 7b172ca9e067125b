#include "gradpsi/cloud.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>

#include "base/median.hpp"
#include "base/sum.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"

namespace gradpsi {
namespace {

/// "point 17", by its number.
std::string point(const std::vector<std::int64_t>& numbers, Eigen::Index i) {
  return "point " + std::to_string(numbers.empty() ? i : numbers[i]);
}

void check_positions(const Positions& x, const std::vector<std::int64_t>& numbers) {
  if (x.cols() < 1 || x.cols() > 3)
    throw InvalidInput("positions must have 1, 2 or 3 columns, not " + std::to_string(x.cols()));
  if (x.rows() > std::numeric_limits<int>::max() - 1)
    throw InvalidInput("at most 2^31 - 2 points, not " + std::to_string(x.rows()));
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    if (!x.row(i).allFinite())
      throw InvalidInput(point(numbers, i) + " has coordinates " + coordinates(x, i) +
                         ", which are not finite");
}

void check_volumes(const Eigen::VectorXd& volumes, Eigen::Index points,
                   const std::vector<std::int64_t>& numbers) {
  if (volumes.size() == 0) return;
  if (volumes.size() != points)
    throw InvalidInput("volumes has " + std::to_string(volumes.size()) + " entries for " +
                       std::to_string(points) + " points");
  for (Eigen::Index i = 0; i < points; ++i)
    if (!(volumes[i] > 0 && std::isfinite(volumes[i])))
      throw InvalidInput(point(numbers, i) + " has volume " + shortest(volumes[i]) +
                         "; volumes must be > 0 and finite");
}

void check_numbers(const std::vector<std::int64_t>& numbers, Eigen::Index points) {
  if (!numbers.empty() && std::ssize(numbers) != points)
    throw InvalidInput("there are " + std::to_string(numbers.size()) + " numbers for " +
                       std::to_string(points) + " points");
}

void check_box(const std::array<double, 3>& box, int dimension) {
  for (int a = 0; a < 3; ++a) {
    if (!(box[a] >= 0 && std::isfinite(box[a])))
      throw InvalidInput("box length " + shortest(box[a]) + " must be >= 0 and finite");
    if (a >= dimension && box[a] != 0)
      throw InvalidInput("the box has a length in direction " + std::to_string(a + 1) +
                         ", the points have " + std::to_string(dimension) + " coordinates");
  }
}

}  // namespace

Cloud::Cloud(Positions positions, CloudOptions options)
    : positions_(std::move(positions)),
      volumes_(std::move(options.volumes)),
      box_(options.box),
      numbers_(std::move(options.numbers)) {
  check_numbers(numbers_, positions_.rows());
  check_positions(positions_, numbers_);
  check_volumes(volumes_, positions_.rows(), numbers_);
  check_box(box_, dimension());
}

double Cloud::spacing(int threads) const {
  if (has_volumes()) {
    Sum sum;
    for (const double volume : volumes_) sum += volume;
    return std::pow(sum.value() / size(), 1.0 / dimension());
  }
  if (size() < 2)
    throw InvalidInput("the spacing of " + std::to_string(size()) +
                       " point(s) without volumes is not defined");
  const double spacing = median(nearest_distances(*this, threads));
  if (!(spacing > 0))
    throw InvalidInput("most points coincide with another one; their spacing is 0");
  return spacing;
}

std::string coordinates(const Positions& x, Eigen::Index i) {
  std::string text = "(";
  for (Eigen::Index a = 0; a < x.cols(); ++a) text += (a > 0 ? ", " : "") + shortest(x(i, a));
  return text + ")";
}

Positions wrapped_positions(const Cloud& cloud) {
  Positions x = cloud.positions();
  for (int a = 0; a < cloud.dimension() && cloud.size() > 0; ++a) {
    const double length = cloud.box()[a];
    if (length == 0) continue;
    const double largest = std::max(length, x.col(a).cwiseAbs().maxCoeff());
    const double last_digit = std::ldexp(1.0, std::ilogb(largest) - 52);
    for (int i = 0; i < cloud.size(); ++i) {
      double y = x(i, a) - length * std::floor(x(i, a) / length);
      y = last_digit * std::nearbyint(y / last_digit);
      x(i, a) = y < length ? y : 0;
    }
  }
  return x;
}

Coincidences coincidences(const Cloud& cloud) {
  const Positions x = wrapped_positions(cloud);
  const auto compare = [&](int i, int j) {
    for (Eigen::Index a = 0; a < x.cols(); ++a)
      if (x(i, a) != x(j, a)) return x(i, a) < x(j, a) ? -1 : 1;
    return 0;
  };
  std::vector<int> order(cloud.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const int c = compare(i, j);
    return c != 0 ? c < 0 : i < j;
  });
  Coincidences result;
  int first = 0;
  int group = 0;  // where in `order` the current group of coincident points begins
  for (int k = 1; k < cloud.size(); ++k) {
    if (compare(order[group], order[k]) != 0) {
      group = k;
      continue;
    }
    if (result.points.empty() || order[k] < first) {
      first = order[k];
      result.first_partner = order[group];
    }
    result.points.push_back(order[k]);
  }
  std::ranges::sort(result.points);
  return result;
}

std::vector<int> distinct_points(const Cloud& cloud) {
  const std::vector<int> dropped = coincidences(cloud).points;
  std::vector<int> all(cloud.size()), kept;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::set_difference(all, dropped, std::back_inserter(kept));
  return kept;
}

Cloud make_cloud(const Lattice& lattice) {
  const int d = lattice.dimension;
  const int m = lattice.points_per_side;
  if (d < 1 || d > 3) throw InvalidInput("dimension must be 1, 2 or 3, not " + std::to_string(d));
  if (m < 1 || std::pow(m, d) > std::numeric_limits<int>::max() - 1)
    throw InvalidInput("points_per_side is " + std::to_string(m) +
                       "; there must be 1 to 2^31 - 2 points");
  const double dx = (lattice.upper - lattice.lower) / m;
  if (!(dx > 0 && std::isfinite(dx)))
    throw InvalidInput("upper must be greater than lower, both finite");
  if (!(lattice.jitter >= 0 && std::isfinite(lattice.jitter)))
    throw InvalidInput("jitter must be >= 0 and finite, not " + shortest(lattice.jitter));
  if (lattice.periodic && lattice.lower != 0)
    throw InvalidInput("a periodic box starts at the origin: lower must be 0");

  // The standard fixes this generator's numbers, but not those of its distributions.
  std::mt19937_64 generator(lattice.seed);
  const auto symmetric_uniform = [&] {
    return std::ldexp(static_cast<double>(generator() >> 11), -52) - 1;
  };
  int n = 1;
  for (int a = 0; a < d; ++a) n *= m;
  Positions x(n, d);
  for (int i = 0; i < n; ++i)
    for (int a = d - 1, rest = i; a >= 0; --a, rest /= m)
      x(i, a) =
          lattice.lower +
          (rest % m + 0.5 + (lattice.jitter > 0 ? lattice.jitter * symmetric_uniform() : 0)) * dx;

  CloudOptions options{.volumes = Eigen::VectorXd::Constant(n, std::pow(dx, d))};
  if (lattice.periodic) std::fill_n(options.box.begin(), d, lattice.upper);
  return Cloud(std::move(x), std::move(options));
}

}  // namespace gradpsi
