// The spacing of points, of all of them and where they are.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <span>
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
#include "search/nearest.hpp"

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
double block_contrast(const Tree<D>& tree, const DenseVector& spacing) {
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
template <int D>
bool is_uneven(const Tree<D>& tree, const DenseVector& spacing) {
  if (spacing.maxCoeff() <= uneven_blocks[D - 1] * spacing.minCoeff()) return false;
  return spacing.maxCoeff() > uneven_point * median(spacing) ||
         block_contrast(tree, spacing) > uneven_blocks[D - 1];
}

/// Who has a point in its list, end to end by points.
struct Listed {
  std::vector<int> offsets, by;

  explicit Listed(const Neighbours& nearest)
      : offsets(nearest.size() + 2), by(nearest.indices.size()) {
    for (const int j : nearest.indices) ++offsets[j + 2];
    for (std::size_t j = 2; j < offsets.size(); ++j) offsets[j] += offsets[j - 1];
    for (int i = 0; i < nearest.size(); ++i)
      for (const int j : nearest.of(i)) by[offsets[j + 1]++] = i;
  }
  std::span<const int> operator()(int j) const {
    return {by.data() + offsets[j], by.data() + offsets[j + 1]};
  }
};

/// The points that raise another one: those with more than `steepest` times its spacing.
std::vector<int> raising(const Neighbours& nearest, const DenseVector& spacing) {
  std::vector<char> raises(nearest.size(), false);
  for (int i = 0; i < nearest.size(); ++i)
    for (const int j : nearest.of(i)) {
      raises[i] |= spacing[j] < spacing[i] / steepest;
      raises[j] |= spacing[i] < spacing[j] / steepest;
    }
  std::vector<int> points;
  for (int i = 0; i < nearest.size(); ++i)
    if (raises[i]) points.push_back(i);
  return points;
}

/// Raises spacings until those of points that are among one another's nearest differ by `steepest` at most;
/// a lone point, which is among nobody's, raises none.
void bound_steps(const Neighbours& nearest, DenseVector& spacing) {
  const std::vector<int> first = raising(nearest, spacing);
  if (first.empty()) return;
  const Listed listed(nearest);
  std::priority_queue<std::pair<double, int>> largest_first;
  for (const int i : first)
    if (!listed(i).empty()) largest_first.emplace(spacing[i], i);
  while (!largest_first.empty()) {
    const double value = largest_first.top().first;
    const int i = largest_first.top().second;
    largest_first.pop();
    if (value < spacing[i]) continue;  // has been raised since
    const auto raise = [&](int j) {
      if (spacing[j] < value / steepest) largest_first.emplace(spacing[j] = value / steepest, j);
    };
    std::ranges::for_each(nearest.of(i), raise);
    std::ranges::for_each(listed(i), raise);
  }
}

/// The usual distance.
double usual(const DenseVector& nearest) {
  const double spacing = median(nearest);
  if (!(spacing > 0))
    throw InvalidInput("most points coincide with another one; their spacing is 0");
  return spacing;
}

/// local_spacing() where there are points enough.
template <int D>
DenseVector local_spacing(const Cloud& cloud, int count, int threads) {
  const bool given = cloud.has_volumes();
  DenseVector one = DenseVector::Constant(1, given ? cloud.spacing(threads) : 0), spacing;
  if (given) {
    spacing = cloud.volumes().array().pow(1.0 / D);
    if (spacing.maxCoeff() <= uneven_blocks[D - 1] * spacing.minCoeff()) return one;
  }
  const Tree<D> tree = tree_of_all<D>(cloud, threads);
  if (given && !is_uneven(tree, spacing)) return one;
  if (!given) one[0] = usual(nearest_distances(tree, threads));
  const DenseVector reach = kth_nearest_distances(tree, count, threads);
  if (!(reach.minCoeff() > 0)) return one;  // find_neighbours() will say who coincide
  if (!given) {
    spacing = reach * std::pow(ball(D) / (count + 0.5), 1.0 / D);
    if (!is_uneven(tree, spacing)) return one;
    spacing *= one[0] / median(spacing);
  }
  bound_steps(find_neighbours(cloud, reach * (1 + 1e-9), threads), spacing);
  return spacing;
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
  return usual(nearest_distances(*this, threads));
}

DenseVector local_spacing(const Cloud& cloud, int threads) {
  const int count = std::min(told_by, cloud.size() - 1);
  if (count < cloud.dimension()) return DenseVector::Constant(1, cloud.spacing(threads));
  checked_threads(threads);
  return dispatch(cloud.dimension(),
                  [&](auto d) { return local_spacing<d>(cloud, count, threads); });
}

}  // namespace gradpsi
