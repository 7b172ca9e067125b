#pragma once

#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// The median |a_ii| of the rows where it is not zero; 0, if there are none.
double median_diagonal(const SparseMatrix& A);

}  // namespace gradpsi
