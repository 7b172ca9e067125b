#pragma once

#include <Eigen/Core>
#include <complex>

namespace gradpsi {

/// @name Dense vectors and matrices of the interface
///
/// Eigen aligns memory as the instructions want it that a file is compiled for, and what one file
/// allocates another one, compiled with -mavx2 or with EIGEN_MAX_ALIGN_BYTES, could not free. Types with
/// DontAlign use malloc() and free() whatever the options, so what passes from the library to its callers
/// or back belongs to such types. They convert to and from Eigen::VectorXd and the like, which copies.
/// Arguments that are only read are views, of any of these types and without a copy.
/// @{

/// Numbers, one a row.
using DenseVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::DontAlign>;
/// Numbers by row and column, stored column by column.
using DenseMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::DontAlign>;
/// n x d, one row per point, d = 1, 2 or 3.
using Positions =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor | Eigen::DontAlign>;
/// Counts or indices.
using IndexVector = Eigen::Matrix<int, Eigen::Dynamic, 1, Eigen::DontAlign>;
/// Complex numbers, such as eigenvalues.
using ComplexVector = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, 1, Eigen::DontAlign>;
/// An argument: a vector of any of these types or of Eigen's, looked at where it is.
using VectorView = Eigen::Ref<const Eigen::VectorXd>;
/// An argument: a matrix, likewise.
using MatrixView = Eigen::Ref<const Eigen::MatrixXd>;
/// @}

/// A vector (Columns 1) or matrix (Eigen::Dynamic) of the caller's that a function gives its size and
/// fills. Memory is taken and freed where the object was made, by the rule of that file.
template <int Columns>
class Result {
 public:
  /// @param x  Eigen::VectorXd or DenseVector; Eigen::MatrixXd or DenseMatrix
  template <int Options>
  requires(Columns == 1 || !(Options & Eigen::RowMajor))
      Result(Eigen::Matrix<double, Eigen::Dynamic, Columns, Options>& x)
      : x_(&x), data_(x.data()), resize_([](void* of, Eigen::Index rows, Eigen::Index columns) {
          using Dense = Eigen::Matrix<double, Eigen::Dynamic, Columns, Options>;
          Dense& dense = *static_cast<Dense*>(of);
          // Eigen's resize() frees the old memory first, and without new one frees it once more at the end.
          if (dense.size() != rows * columns) dense = Dense();
          dense.resize(rows, columns);
          return dense.data();
        }) {}

  const double* data() const { return data_; }  ///< what it held when the call began
  /// Gives it its size.
  /// @return its memory, a column after the other
  double* resized(Eigen::Index rows, Eigen::Index columns = 1) const {
    return resize_(x_, rows, columns);
  }

 private:
  void* x_;
  const double* data_;
  double* (*resize_)(void* of, Eigen::Index rows, Eigen::Index columns);
};

}  // namespace gradpsi
