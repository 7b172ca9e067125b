#include <cmath>
#include <string>

#include "base/cpu.hpp"
#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "gradpsi/assemble.hpp"
#include "gradpsi/error.hpp"
#include "operators/batch/batch.hpp"
#include "operators/batch/points.hpp"
#include "schemes/check.hpp"
#include "search/check.hpp"

namespace gradpsi {

namespace {

/// 1 / sum_j W_ij, W the kernel of so many dimensions.
DenseVector number_density_measures(const Cloud& cloud, const Neighbours& near,
                                    const Kernel& kernel, int dimension, int threads) {
  check_match(cloud, near, threads);
  check_kernel(kernel, dimension);
  return dispatch(cloud.dimension(), [&](auto d) {
    constexpr int D = decltype(d)::value;
    DenseVector volumes(cloud.size());
    const DensityFunction density = batch_kernels(cpu()).density[D - 1];
    const BatchPoints points = batch_points(cloud, near, kernel, volumes);
    const int* const order = near.order.size() > 0 ? near.order.data() : nullptr;
    parallel_chunks(cloud.size(), 1024, threads, [&](int begin, int end) {
      density(points, near.offsets.data(), near.indices.data(), order ? order + begin : nullptr,
              begin, end - begin, volumes.data());
    });
    for (int i = 0; i < cloud.size(); ++i) {
      const double h = near.support(i);
      double unit = 1 / kernel.normalisation[dimension - 1];
      for (int a = 0; a < dimension; ++a) unit *= h;
      volumes[i] *= unit;
      if (!(std::isnormal(volumes[i]) && volumes[i] > 0))
        throw InvalidInput("the number density of point " + std::to_string(cloud.number(i)) +
                           " with support " + shortest(h) + " is beyond the range of a double");
    }
    return volumes;
  });
}

}  // namespace

DenseVector number_density_volumes(const Cloud& cloud, const Neighbours& near, const Kernel& kernel,
                                   int threads) {
  return number_density_measures(cloud, near, kernel, cloud.dimension(), threads);
}

DenseVector number_density_areas(const Cloud& cloud, const Neighbours& near, const Kernel& kernel,
                                 int threads) {
  return number_density_measures(cloud, near, kernel, 2, threads);
}

}  // namespace gradpsi
