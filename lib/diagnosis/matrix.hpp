#pragma once

#include "gradpsi/dense.hpp"

namespace gradpsi {

/// The median |a_ii| of the rows where it is not zero; 0, if there are none.
double median_diagonal(const VectorView& diagonal);

}  // namespace gradpsi
