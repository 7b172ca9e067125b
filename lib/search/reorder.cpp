#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "gradpsi/cloud.hpp"
#include "search/tree.hpp"

namespace gradpsi {

Reordered reorder(const Cloud& cloud, int threads) {
  checked_threads(threads);
  std::vector<int> order(cloud.size());
  if (cloud.size() > 0)
    dispatch(cloud.dimension(), [&](auto d) {
      const auto tree = tree_of_all<decltype(d)::value>(cloud, threads);
      for (int k = 0; k < cloud.size(); ++k) order[k] = tree.number(k);
    });
  CloudOptions options{.box = cloud.box()};
  if (cloud.has_volumes()) options.volumes = cloud.volumes()(order);
  return {Cloud(cloud.positions()(order, Eigen::all), std::move(options)), std::move(order)};
}

}  // namespace gradpsi
