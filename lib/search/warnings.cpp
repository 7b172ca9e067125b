#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/neighbours.hpp"
#include "search/check.hpp"

namespace gradpsi {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;

/// The neighbour that is nearest to point i, which has some.
int nearest_neighbour(const Cloud& cloud, const Neighbours& near, int i) {
  return dispatch(cloud.dimension(), [&](auto d) {
    return std::ranges::min(near.of(i), {}, [&](int j) {
      return (displacement<decltype(d)::value>(cloud, i, j) / near.support(i)).squaredNorm();
    });
  });
}

}  // namespace

std::vector<std::string> warnings(const Cloud& cloud, const Neighbours& near, int threads) {
  check_match(cloud, near, threads);
  // The vector code of the search takes half the time of a pass over the lists, which jumps about in memory.
  DenseVector q = nearest_distances(cloud, threads);  // in units of the support
  // A point without neighbours, or whose neighbours are not known, is not among those near one another.
  for (int i = 0; i < cloud.size(); ++i)
    q[i] = near.count(i) > 0 ? q[i] / near.support(i) : infinity;
  DenseVector found = q;
  const auto end = std::remove_if(found.begin(), found.end(), [](double x) { return x >= 1; });
  found.conservativeResize(end - found.begin());
  if (found.size() == 0) return {};
  const double usual = median(std::move(found));

  // A pair is close in units of both supports, not of one that is large among small ones.
  for (int k = 0; k < cloud.size(); ++k)
    if (q[k] < much_closer * usual)
      q[k] *= std::max(1.0, near.support(k) / near.support(nearest_neighbour(cloud, near, k)));

  std::vector<std::string> result;
  Eigen::Index i;
  if (const double least = q.minCoeff(&i); least < much_closer * usual) {
    const int partner = nearest_neighbour(cloud, near, static_cast<int>(i));
    const double h = near.support(static_cast<int>(i));
    const auto close = (q.array() < much_closer * usual).count();
    result.push_back("points " + std::to_string(cloud.number(static_cast<int>(i))) + " and " +
                     std::to_string(cloud.number(partner)) + " are " + rounded(least * h) +
                     " apart, where the nearest point is usually " + rounded(usual * h) +
                     " away; " + std::to_string(close) +
                     " points have one within a hundredth of that: weights that grow as points "
                     "approach are dominated by such pairs");
  }
  const double largest = cloud.positions().cwiseAbs().maxCoeff();
  const double dx = usual * (near.supports.size() == 1 ? near.supports[0] : median(near.supports));
  if (const double part = 2 * rounding * (largest / dx); part > much_rounded)
    result.push_back("coordinates reach " + rounded(largest) + " where points are " + rounded(dx) +
                     " apart: they are rounded by " + rounded(part) +
                     " of that distance. First derivatives of a field u are off by up to about " +
                     rounded(part) + " |grad u|, Laplacians by " + rounded(part / dx) +
                     " |grad u|, unless the coordinates are exact as they are; subtract an origin "
                     "near the points before their digits are lost");
  return result;
}

}  // namespace gradpsi
