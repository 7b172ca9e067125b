#pragma once

#include <Eigen/SparseCore>

namespace gradpsi {

/// Rows compressed, columns ascending, indices of 32 bits.
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;

#if EIGEN_MAJOR_VERSION > 4 || EIGEN_MINOR_VERSION >= 90
/// Eigen 5 aligns sparse matrices, too, and has no DontAlign for them: a program whose options ask for
/// another alignment than the library's would crash. It does not link instead, for want of this function.
/// Compile both with the same -m, -march and EIGEN_MAX_ALIGN_BYTES.
template <int alignment, bool by_malloc>
struct __attribute__((visibility("default"))) EigenAligns {
  static bool as_the_library_does();  ///< true
};
inline const bool aligned_alike =
    EigenAligns<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED>::as_the_library_does();
#endif

}  // namespace gradpsi
