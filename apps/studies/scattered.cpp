#include "studies/scattered.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

namespace gradpsi::apps::scattered {

namespace {

using Point = Eigen::RowVectorXd;

/// Numbers in [0, 1), the same on every platform.
class Uniform {
 public:
  explicit Uniform(int seed) : generator_(static_cast<std::uint64_t>(seed)) {}
  double operator()() { return std::ldexp(static_cast<double>(generator_() >> 11), -53); }

 private:
  std::mt19937_64 generator_;
};

/// The digits of k to a base, mirrored at the point.
double radical_inverse(int k, int base) {
  double result = 0;
  for (double digit = 1.0 / base; k > 0; k /= base, digit /= base) result += k % base * digit;
  return result;
}

/// A cloud of the unit cube, the box it is periodic in.
struct Base {
  Positions x;
  std::array<double, 3> box = {1, 1, 1};
};

Base lattice(int dimension, int side, int seed) {
  static constexpr std::array jitters = {0.1, 0.25, 0.4};
  return {make_cloud({.dimension = dimension,
                      .points_per_side = side,
                      .jitter = jitters[seed % 3],
                      .seed = static_cast<std::uint64_t>(seed)})
              .positions()};
}

/// Rows of triangles, hardly disturbed; the upper edge is where the last row ends.
Base hexagonal(int side, Uniform uniform) {
  const double dx = 1.0 / side, dy = dx * std::sqrt(0.75);
  const int rows = side + side / 7 * 1 + side % 2;
  Base base{Positions(side * rows, 2)};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < side; ++c)
      base.x.row(r * side + c) << (c + 0.25 + 0.5 * (r % 2) + 0.2 * (uniform() - 0.5)) * dx,
          (r + 0.5 + 0.2 * (uniform() - 0.5)) * dy;
  base.box[1] = rows * dy;
  return base;
}

Base halton(int dimension, int count, int seed) {
  static constexpr std::array bases = {2, 3, 5};
  Base base{Positions(count, dimension)};
  for (int i = 0; i < count; ++i)
    for (int a = 0; a < dimension; ++a)
      base.x(i, a) = radical_inverse(1 + i + 1000 * seed, bases[a]);
  return base;
}

Base random(int dimension, int count, Uniform uniform) {
  Base base{Positions(count, dimension)};
  for (double& x : base.x.reshaped()) x = uniform();
  return base;
}

Base base(Points points, int dimension, int side, int seed) {
  const int count = static_cast<int>(std::lround(std::pow(side, dimension)));
  switch (points) {
    case Points::Lattice: return lattice(dimension, side, seed);
    case Points::Hexagonal: return hexagonal(side, Uniform(seed));
    case Points::Halton: return halton(dimension, count, seed);
    case Points::Random: return random(dimension, count, Uniform(seed));
  }
  return {};
}

/// How far inside a shape a point is; < 0: outside.
double depth(Shape shape, const Point& x, const Point& box) {
  double result = std::min(x.minCoeff(), (box - x).minCoeff());
  if (shape == Shape::Annulus) {
    const double radius = (x - box / 2).norm();
    result = std::min(0.5 - radius, radius - 0.2);
  }
  if (shape == Shape::L) {  // without the corner where all coordinates are above 0.45
    const Eigen::ArrayXd beyond = (x.array() - 0.45).transpose();
    const double to_corner = -beyond.minCoeff();
    result = std::min(result, to_corner);
  }
  return result;
}

constexpr std::array all_kinds = {
    Kind{"graded 10:1", Points::Lattice, Shape::Whole, 0.65},
    Kind{"graded 100:1", Points::Lattice, Shape::Whole, 1.25},
    Kind{"Halton", Points::Halton},
    Kind{"random", Points::Random},
    Kind{.name = "hexagonal",
         .points = Points::Hexagonal,
         .least_dimension = 2,
         .most_dimension = 2},
    Kind{.name = "annulus",
         .points = Points::Lattice,
         .shape = Shape::Annulus,
         .least_dimension = 2},
    Kind{.name = "L", .points = Points::Lattice, .shape = Shape::L, .least_dimension = 2},
    Kind{.name = "L with uneven supports",
         .points = Points::Lattice,
         .shape = Shape::L,
         .uneven_supports = true,
         .least_dimension = 2},
    Kind{.name = "line with uneven supports",
         .points = Points::Lattice,
         .uneven_supports = true,
         .most_dimension = 1}};

}  // namespace

std::span<const Kind> kinds() { return all_kinds; }

Scene scene(const Kind& kind, int dimension, int side, int seed, bool periodic) {
  const Base all = base(kind.points, dimension, side, seed);
  const Point box = Eigen::Map<const Eigen::RowVectorXd>(all.box.data(), dimension);
  std::vector<int> kept, inner;
  for (int i = 0; i < all.x.rows(); ++i) {
    const double inside = depth(kind.shape, all.x.row(i), box);
    if (inside < 0 && kind.shape != Shape::Whole) continue;
    if (periodic || inside > 0.7 / side) inner.push_back(static_cast<int>(kept.size()));
    kept.push_back(i);
  }
  Positions x = all.x(kept, Eigen::all);
  for (auto row : x.rowwise()) row *= std::pow(row.norm(), kind.grading);
  Uniform uniform(seed + 1);
  DenseVector stretch = DenseVector::Ones(x.rows());
  if (kind.uneven_supports)
    for (double& s : stretch) s += 0.5 * uniform();
  CloudOptions options;
  if (periodic) std::copy_n(all.box.begin(), dimension, options.box.begin());
  return {Cloud(std::move(x), options), std::move(inner), std::move(stretch)};
}

}  // namespace gradpsi::apps::scattered
