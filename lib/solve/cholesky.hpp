#pragma once

#include <Eigen/Core>
#include <memory>

#include "gradpsi/matrix.hpp"
#include "solve/factor.hpp"

namespace gradpsi {

/// Cholesky factorisation of S = diag(scale) A, A compressed, S symmetric: the upper triangle of A is
/// read. Analysed once, factorised for any values in the same pattern.
class Cholesky {
 public:
  /// @param scale  n numbers > 0
  /// @throws FactorTooLarge  if the factor would take more than `memory` bytes
  Cholesky(const SparseMatrix& A, Eigen::VectorXd scale, const Elimination& elimination,
           double memory, int threads);
  Cholesky(Cholesky&&) noexcept;
  Cholesky& operator=(Cholesky&&) noexcept;
  ~Cholesky();

  /// Whether S is positive definite; only then can solve() be called.
  bool factorise(const SparseMatrix& A);

  /// x = A^-1 b for each of the columns, n x k, which may be one and the same memory; allocates
  /// nothing if the call before had as many.
  void solve(const double* b, double* x, int columns);

  const FactorReport& report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gradpsi
