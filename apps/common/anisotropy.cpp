#include "common/anisotropy.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <random>
#include <vector>

#include "common/points.hpp"
#include "common/principal.hpp"

namespace gradpsi::apps {

namespace {

constexpr int sample_size = 500, most_rounds = 25;
constexpr double suspicious = 3, even_enough = 1.5;      // largest over least share of a direction
constexpr double least_ratio = 3, largest_ratio = 1000;  // that is told

std::vector<int> sample(int n) {
  std::vector<int> all(n), chosen;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::sample(all, std::back_inserter(chosen), sample_size, std::mt19937_64(1));
  return chosen;
}

/// The displacements to the 2d nearest of a point's neighbours: those of a lattice, one each way.
Eigen::MatrixXd nearest(const Positions& x, const Neighbours& near, int i) {
  const Eigen::Index d = x.cols();
  Eigen::MatrixXd r(near.count(i), d);
  for (int k = 0; k < near.count(i); ++k) r.row(k) = x.row(near.of(i)[k]) - x.row(i);
  std::vector<int> order(r.rows());
  std::iota(order.begin(), order.end(), 0);
  const auto count = std::min(order.size(), static_cast<std::size_t>(2 * d));
  std::ranges::partial_sort(order, order.begin() + count, {},
                            [&](int k) { return r.row(k).squaredNorm(); });
  order.resize(count);
  return r(order, Eigen::all);
}

/// What part of the nearest neighbours lies along each direction, d x d with trace 1: of their number, or of
/// their squared distances.
struct Shares {
  Eigen::MatrixXd number, square;
};
Shares shares(const Positions& x, const Neighbours& near, const std::vector<int>& points) {
  const Eigen::Index d = x.cols();
  Shares result{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  for (const int i : points) {
    const Eigen::MatrixXd r = nearest(x, near, i);
    if (r.rows() == 0) continue;
    const Eigen::MatrixXd e = r.rowwise().normalized();
    result.number += e.transpose() * e;
    result.square += r.transpose() * r / r.squaredNorm();
  }
  result.number /= std::max(result.number.trace(), 1e-300);
  result.square /= std::max(result.square.trace(), 1e-300);
  return result;
}

double unevenness(const Eigen::MatrixXd& shares) {
  const Eigen::VectorXd values = principal_axes(shares).values;
  return values.maxCoeff() / std::max(values.minCoeff(), 1e-12);
}

/// V f(values) V^T
template <class Function>
Eigen::MatrixXd function_of(const Eigen::MatrixXd& symmetric, const Function& f) {
  const auto [values, V] = principal_axes(symmetric);
  return V * values.unaryExpr(f).asDiagonal() * V.transpose();
}

/// The positions times this matrix have spacings alike in all directions; empty if none is found.
Eigen::MatrixXd evening_stretch(const Cloud& cloud, const std::vector<int>& points, int threads) {
  const int d = cloud.dimension();
  Eigen::MatrixXd stretch = Eigen::MatrixXd::Identity(d, d);
  double power = 0.5;
  for (int round = 0; round < most_rounds; ++round, power *= 0.85) {
    const Cloud stretched(Positions(cloud.positions() * stretch));
    const DenseVector reach = kth_nearest_distances(stretched, 2 * d, threads) * (1 + 1e-9);
    const Neighbours near = find_neighbours(stretched, reach, points, threads);
    const auto [number, square] = shares(stretched.positions(), near, points);
    if (unevenness(number) < even_enough)
      return stretch * function_of(d * square, [](double c) { return 1 / std::sqrt(c); });
    // Where the nearest are too many, they are too close.
    stretch *= function_of(d * number, [&](double c) { return std::pow(c + 0.3, power); });
  }
  return {};
}

}  // namespace

std::optional<Anisotropy> anisotropy(const Cloud& cloud, const Neighbours& near, int threads) {
  const int d = cloud.dimension();
  if (d == 1 || cloud.size() < 50) return {};
  const std::vector<int> points = sample(cloud.size());
  if (unevenness(shares(cloud.positions(), near, points).number) < suspicious) return {};
  const Eigen::MatrixXd stretch = evening_stretch(cloud, points, threads);
  if (stretch.size() == 0) return {};
  const auto [squares, axes] = principal_axes(stretch * stretch.transpose());
  const double ratio = std::sqrt(squares[d - 1] / squares[0]);
  if (!(ratio >= least_ratio && ratio <= largest_ratio)) return {};
  const Cloud stretched(Positions(cloud.positions() * stretch));
  return Anisotropy{ratio, axes.col(d - 1), stretched.spacing(threads) / std::sqrt(squares[0])};
}

std::string words(const Anisotropy& found, const std::string& axes) {
  Eigen::Index axis;
  std::string along;
  if (found.direction.cwiseAbs().maxCoeff(&axis) > 0.99)
    along = axes.substr(axis, 1);
  else
    for (const double component : found.direction)
      along += (along.empty() ? "(" : ", ") + text(std::round(100 * component) / 100);
  if (along.size() > 1) along += ")";
  return "spacings differ by direction: along " + along + " they are about " +
         text(std::round(found.ratio)) + " times smaller than the largest, " + text(found.largest) +
         ", while supports are balls";
}

}  // namespace gradpsi::apps
