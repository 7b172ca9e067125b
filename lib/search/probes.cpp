#include "search/probes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "search/check.hpp"
#include "search/leaf_search.hpp"
#include "search/tree.hpp"

namespace gradpsi {
namespace {

constexpr int probes_per_chunk = 256;

void check_probes(const Cloud& cloud, const Positions& probes) {
  if (probes.cols() != cloud.dimension())
    throw InvalidInput("the probes have " + std::to_string(probes.cols()) +
                       " coordinates, the points " + std::to_string(cloud.dimension()));
  for (Eigen::Index k = 0; k < probes.rows(); ++k)
    if (!probes.row(k).allFinite())
      throw InvalidInput("probe " + std::to_string(k) +
                         " has a coordinate that is not finite: " + coordinates(probes, k));
}

/// The points in the probes' box widened by the reach, in periodic directions all.
std::vector<int> points_around(const Cloud& cloud, const Positions& probes, double reach) {
  std::vector<int> result;
  if (probes.rows() == 0) return result;
  const auto d = probes.cols();
  Eigen::RowVectorXd low = probes.colwise().minCoeff(), high = probes.colwise().maxCoeff();
  low.array() -= reach, high.array() += reach;
  for (Eigen::Index a = 0; a < d; ++a)
    if (cloud.box()[a] > 0) {
      low[a] = -std::numeric_limits<double>::infinity();
      high[a] = -low[a];
    }
  const double* x = cloud.positions().data();
  for (int i = 0; i < cloud.size(); ++i, x += d) {
    bool inside = true;
    for (Eigen::Index a = 0; a < d; ++a) inside = inside && x[a] >= low[a] && x[a] <= high[a];
    if (inside) result.push_back(i);
  }
  return result;
}

/// The points around some probes, found probe by probe.
template <int D>
class ProbeSearch {
 public:
  /// @param numbers   of the tree's points in the cloud
  /// @param supports  of the cloud's points, or one
  ProbeSearch(const Tree<D>& tree, const std::vector<int>& numbers, const VectorView& supports)
      : tree_(tree), numbers_(numbers), supports_(supports) {}

  struct Found {
    std::vector<int> points;  // of the cloud, ascending
    double support;
    bool outside;
  };
  Found operator()(const Point<D>& x) {
    Found found{{}, supports_[0], true};
    if (supports_.size() > 1) {
      const int point = nearest(x).number;
      if (point < 0) return found;
      found.support = supports_[numbers_[point]];
    }
    const double h = tree_.to_units(found.support);
    search_.gather(tree_, x, h);
    search_.sort();
    found.points.resize(search_.most());
    found.points.resize(search_.select_all(x, h, found.points.data()));
    found.outside = !(search_.nearest(x).squared <= h * h / 4);
    for (int& point : found.points) point = numbers_[point];
    return found;
  }

 private:
  /// Within the largest support.
  typename LeafSearch<D>::Nearest nearest(const Point<D>& x) {
    const double most = tree_.to_units(supports_.maxCoeff());
    for (double reach = tree_.to_units(supports_.minCoeff());; reach *= 2) {
      search_.gather(tree_, x, std::min(reach, most));
      const auto found = search_.nearest(x);
      if (found.squared <= reach * reach || reach >= most) return found;
    }
  }

  const Tree<D>& tree_;
  const std::vector<int>& numbers_;
  VectorView supports_;
  LeafSearch<D> search_;
};

/// Throws for probes outside the cloud, as far as they are told apart.
void throw_if_outside(const Cloud& cloud, const Positions& probes,
                      const std::vector<unsigned char>& outside) {
  constexpr int told = 3;
  const auto count = std::ranges::count(outside, 1);
  if (count == 0) return;
  std::string which;
  int tells = 0;
  for (Eigen::Index k = 0; k < probes.rows() && tells < told; ++k) {
    if (!outside[k]) continue;
    ++tells;
    which += (which.empty() ? "probe " : ", probe ") + std::to_string(k) + " at " +
             coordinates(probes, k);
    if (cloud.size() == 0) continue;
    const auto distance = [&](int i) {
      return dispatch(cloud.dimension(), [&](auto d) {
        return displacement<decltype(d)::value>(probes.row(k).data(),
                                                cloud.positions().row(i).data(), cloud.box())
            .norm();
      });
    };
    double least = distance(0);
    int nearest = 0;
    for (int i = 1; i < cloud.size(); ++i)
      if (const double r = distance(i); r < least) least = r, nearest = i;
    which += ", " + rounded(least) + " from point " + std::to_string(cloud.number(nearest));
  }
  throw InvalidInput(std::to_string(count) + " of " + std::to_string(probes.rows()) + " probes " +
                     (count == 1 ? "is" : "are") +
                     " outside the cloud, farther from its nearest point than half the support: " +
                     which + (count > tells ? ", .." : ""));
}

}  // namespace

Neighbours neighbours_of_probes(const Cloud& cloud, const Positions& probes,
                                const VectorView& supports, int threads) {
  checked_threads(threads);
  check_probes(cloud, probes);
  check_supports(cloud, supports);
  const auto m = static_cast<int>(probes.rows());
  std::vector<unsigned char> outside(m, 1);
  const double largest = supports.size() > 0 ? supports.maxCoeff() : 1;
  const std::vector<int> numbers = points_around(cloud, probes, largest);
  if (numbers.empty()) throw_if_outside(cloud, probes, outside);
  Neighbours near{IndexVector::Zero(m + 1), {}, {}};
  near.supports = supports.size() == 1 ? DenseVector(supports) : DenseVector(m);
  if (m == 0) return near;
  const Cloud around(cloud.positions()(numbers, Eigen::all), {.box = cloud.box()});
  const Cloud places(probes, {.box = cloud.box()});
  std::vector<std::vector<int>> lists(m);
  dispatch(cloud.dimension(), [&](auto d) {
    const Tree<d> tree(around, largest, threads);
    const auto x = tree.scaled(places, threads);
    parallel_chunks(
        m, probes_per_chunk, threads,
        [&, search = ProbeSearch<d>(tree, numbers, supports)](int begin, int end) mutable {
          for (int k = begin; k < end; ++k) {
            auto found = search(x[k]);
            outside[k] = found.outside;
            if (supports.size() > 1) near.supports[k] = found.support;
            lists[k] = std::move(found.points);
          }
        });
  });
  throw_if_outside(cloud, probes, outside);
  std::int64_t entries = 0;
  for (int k = 0; k < m; ++k)
    near.offsets[k + 1] = static_cast<int>(entries += std::ssize(lists[k]));
  if (entries > std::numeric_limits<int>::max())
    throw InvalidInput("the probes would have " + std::to_string(entries) +
                       " neighbours, more than 2^31 - 1");
  near.indices.resize(entries);
  for (int k = 0; k < m; ++k) std::ranges::copy(lists[k], near.indices.data() + near.offsets[k]);
  return near;
}

}  // namespace gradpsi
