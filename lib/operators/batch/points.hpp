#pragma once

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/neighbours.hpp"
#include "operators/batch/batch.hpp"
#include "schemes/check.hpp"

namespace gradpsi {

/// The arguments' arrays, as the vector code wants them.
inline BatchPoints batch_points(const Cloud& cloud, const Neighbours& near, const Kernel& kernel,
                                const VectorView& volumes) {
  return {cloud.positions().data(),
          volumes.data(),
          {cloud.box()[0], cloud.box()[1], cloud.box()[2]},
          vector_kernel(kernel),
          kernel.profile,
          kernel.normalisation[cloud.dimension() - 1],
          near.supports.data(),
          near.supports.size() == 1,
          near.skin > 0};
}

}  // namespace gradpsi
