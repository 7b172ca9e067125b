#pragma once

#include <string>

#include "gradpsi/error.hpp"
#include "gradpsi/kernel.hpp"

namespace gradpsi {

/// Throws InvalidInput unless the kernel can be used in this dimension.
inline void check_kernel(const Kernel& kernel, int dimension) {
  if (!kernel.profile)
    throw InvalidInput("kernel '" + std::string(kernel.name) + "' has no profile");
  if (!(kernel.normalisation[dimension - 1] > 0))
    throw InvalidInput("kernel '" + std::string(kernel.name) + "' has no normalisation in " +
                       std::to_string(dimension) + " dimensions");
}

/// The kernel's number among VectorKernels; -1: it is none of these.
int vector_kernel(const Kernel& kernel);

}  // namespace gradpsi
