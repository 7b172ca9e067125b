#pragma once

#include <Eigen/Core>
#include <memory>

#include "gradpsi/matrix.hpp"
#include "solve/factor.hpp"

namespace gradpsi {

/// LU factorisation of a compressed A; analysed once, factorised for any values in the same pattern.
class Lu {
 public:
  /// @throws FactorTooLarge  if it is expected to take more than `memory` bytes
  Lu(const SparseMatrix& A, const Elimination& elimination, double memory, int threads);
  Lu(Lu&&) noexcept;
  Lu& operator=(Lu&&) noexcept;
  ~Lu();

  /// @throws SolverError  if A is singular
  void factorise(const SparseMatrix& A);

  /// x = A^-1 b for each of the columns, n x k; allocates nothing.
  void solve(const double* b, double* x, int columns);

  const FactorReport& report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gradpsi
