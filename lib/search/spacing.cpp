// The spacing of points, of all of them and where they are.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "base/sum.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"
#include "search/tree.hpp"

namespace gradpsi {
namespace {

/// Points whose nearest ones tell their spacing: enough for chance to even out, few enough to be near.
constexpr int told_by = 12;

/// Largest of points over the median, and largest over least of the means of `in_block` points that are near
/// one another, that random points without any order come to, in 1D, 2D and 3D: measured on up to a million.
constexpr double uneven_point = 3, uneven_blocks[] = {2.5, 1.6, 1.6};
constexpr int in_block = 64;

/// Spacings of points that are among one another's nearest differ by this factor at most.
constexpr double steepest = 1.5;

/// The volume of the unit ball.
double ball(int dimension) {
  return std::array{2.0, std::numbers::pi, 4 * std::numbers::pi / 3}[dimension - 1];
}

/// The largest over the least of the blocks' geometric means.
template <int D>
double block_contrast(const Cloud& cloud, const DenseVector& spacing, int threads) {
  const Tree<D> tree = tree_of_all<D>(cloud, threads);
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (int begin = 0; begin < tree.size(); begin += in_block) {
    if (begin > 0 && tree.size() - begin < in_block) break;  // too few to tell
    const int end = std::min(begin + in_block, tree.size());
    double sum = 0;
    for (int k = begin; k < end; ++k) sum += std::log(spacing[tree.number(k)]);
    least = std::min(least, sum / (end - begin));
    most = std::max(most, sum / (end - begin));
  }
  return std::exp(most - least);
}

/// Whether spacings vary by more than chance can explain.
bool is_uneven(const Cloud& cloud, const DenseVector& spacing, int threads) {
  if (spacing.maxCoeff() <= uneven_blocks[cloud.dimension() - 1] * spacing.minCoeff()) return false;
  if (spacing.maxCoeff() > uneven_point * median(spacing)) return true;
  return dispatch(cloud.dimension(), [&](auto d) {
    return block_contrast<d>(cloud, spacing, threads) > uneven_blocks[d - 1];
  });
}

/// Raises spacings until those of points that are among one another's nearest differ by `steepest` at most;
/// a lone point, which is among nobody's, raises none.
void bound_steps(const Neighbours& nearest, DenseVector& spacing) {
  const int n = nearest.size();
  std::vector<std::vector<int>> in_whose_list(n);
  for (int i = 0; i < n; ++i)
    for (const int j : nearest.of(i)) in_whose_list[j].push_back(i);
  std::priority_queue<std::pair<double, int>> largest_first;
  for (int i = 0; i < n; ++i)
    if (!in_whose_list[i].empty()) largest_first.emplace(spacing[i], i);
  while (!largest_first.empty()) {
    const double value = largest_first.top().first;
    const int i = largest_first.top().second;
    largest_first.pop();
    if (value < spacing[i]) continue;  // has been raised since
    const auto raise = [&](int j) {
      if (spacing[j] < value / steepest) largest_first.emplace(spacing[j] = value / steepest, j);
    };
    std::ranges::for_each(nearest.of(i), raise);
    std::ranges::for_each(in_whose_list[i], raise);
  }
}

}  // namespace

double Cloud::spacing(int threads) const {
  checked_threads(threads);
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

DenseVector local_spacing(const Cloud& cloud, int threads) {
  const double usual = cloud.spacing(threads);
  const DenseVector one = DenseVector::Constant(1, usual);
  const int d = cloud.dimension(), count = std::min(told_by, cloud.size() - 1);
  if (count < d) return one;
  const bool given = cloud.has_volumes();
  DenseVector spacing = given ? DenseVector(cloud.volumes().array().pow(1.0 / d)) : DenseVector();
  if (given && !is_uneven(cloud, spacing, threads)) return one;
  const DenseVector reach = kth_nearest_distances(cloud, count, threads);
  if (!(reach.minCoeff() > 0)) return one;  // find_neighbours() will say who coincide
  if (!given) {
    spacing = reach * std::pow(ball(d) / (count + 0.5), 1.0 / d);
    if (!is_uneven(cloud, spacing, threads)) return one;
    spacing *= usual / median(spacing);
  }
  bound_steps(find_neighbours(cloud, reach * (1 + 1e-9), threads), spacing);
  return spacing;
}

}  // namespace gradpsi
