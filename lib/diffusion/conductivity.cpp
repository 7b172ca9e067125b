#include <cmath>
#include <string>

#include "base/text.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spmv.hpp"
#include "matrix/pass.hpp"

namespace gradpsi {

namespace {

void check(const Operator& laplacian, const VectorView& conductivity) {
  if (laplacian.axes.size() != 1)
    throw InvalidInput("a conductivity goes with a Laplacian, one matrix, not " +
                       std::to_string(laplacian.axes.size()));
  const SparseMatrix& psi = laplacian.matrix();
  if (conductivity.size() != psi.cols() || (laplacian.points.empty() && psi.rows() != psi.cols()))
    throw InvalidInput("there are " + std::to_string(conductivity.size()) +
                       " conductivities for a Laplacian of " + std::to_string(psi.rows()) + " x " +
                       std::to_string(psi.cols()));
  for (Eigen::Index i = 0; i < conductivity.size(); ++i)
    if (!(conductivity[i] > 0 && std::isfinite(conductivity[i])))
      throw InvalidInput("the conductivity at point " + std::to_string(i) +
                         " must be > 0 and finite, not " + shortest(conductivity[i]));
}

}  // namespace

Operator with_conductivity(Operator laplacian, const VectorView& conductivity, Mean mean) {
  check(laplacian, conductivity);
  SparseMatrix& psi = laplacian.axes.front();
  constexpr double rounding = 1e-12;
  for (int k = 0; k < psi.rows(); ++k) {
    const int i = laplacian.point(k);
    double sum = 0, kept = 0, size = 0;  // kept: what the row sums to
    for (SparseMatrix::InnerIterator a(psi, k); a; ++a) {
      kept += a.value();
      size += std::abs(a.value());
    }
    if (std::abs(kept) <= rounding * size) kept = 0;
    double* diagonal = nullptr;
    for (SparseMatrix::InnerIterator a(psi, k); a; ++a) {
      const double here = conductivity[i], there = conductivity[a.col()];
      if (a.col() == i) {
        diagonal = &a.valueRef();
      } else {
        a.valueRef() *= mean == Mean::Arithmetic ? (here + there) / 2 : 2 / (1 / here + 1 / there);
        sum += a.value();
      }
    }
    if (diagonal) *diagonal = conductivity[i] * kept - sum;
  }
  laplacian.rows.errors.resize(0);  // these were of the Laplacian
  return laplacian;
}

Operator with_conductivity(Operator laplacian, const Operator& gradient,
                           const VectorView& conductivity) {
  check(laplacian, conductivity);
  SparseMatrix& psi = laplacian.axes.front();
  if (gradient.axes.empty() || gradient.points != laplacian.points ||
      !same_pattern(gradient.matrix(), psi))
    throw InvalidInput("the Laplacian and the gradient do not share their rows and pattern");
  DenseMatrix slope;
  multiply(gradient.axes, conductivity, slope);
  for (int row = 0; row < psi.rows(); ++row)
    for (int k = psi.outerIndexPtr()[row]; k < psi.outerIndexPtr()[row + 1]; ++k) {
      double& a = psi.valuePtr()[k];
      a *= conductivity[laplacian.point(row)];
      for (std::size_t axis = 0; axis < gradient.axes.size(); ++axis)
        a += slope(row, static_cast<Eigen::Index>(axis)) * gradient.axes[axis].valuePtr()[k];
    }
  laplacian.rows.errors.resize(0);  // these were of the Laplacian
  return laplacian;
}

}  // namespace gradpsi
