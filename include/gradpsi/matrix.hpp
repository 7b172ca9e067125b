#pragma once

#include <Eigen/SparseCore>

namespace gradpsi {

/// Rows compressed, columns ascending, indices of 32 bits.
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;

}  // namespace gradpsi
