#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// Krylov methods for A x = b with the memory they need, n numbers each. Sums are taken block by
/// block, so that results do not depend on the number of threads.
class Krylov {
 public:
  /// z = M^-1 r, M a preconditioner of A.
  using Precondition = std::function<void(const double* r, double* z)>;

  /// Iterations end when |b - A x| <= target by their recursion, or after `limit` of them.
  struct Goal {
    double target;
    int limit;
    std::function<void(int iteration, double norm)> progress =
        {};  // called after each, if there is one
    bool is_reached(int iteration, double norm) const {
      if (progress) progress(iteration, norm);
      return norm <= target;
    }
  };

  /// A, or A + strength 1 weights^T: regular where constants are in A's null space, its solution is one of
  /// A x + c = b with c = strength weights . x. Weights' sum is not 0.
  struct Matrix {
    const SparseMatrix& A;
    const double* weights = nullptr;
    double strength = 0;
  };

  Krylov(int n, int threads);

  /// Conjugate gradients for S = diag(scale) A symmetric positive definite, M similar to A and diag(scale) M
  /// symmetric positive definite; and BiCGSTAB for any A (H. A. van der Vorst, SIAM J. Sci. Stat. Comput.
  /// 13, 1992), restarted where the residual has become orthogonal to its start. Both start from x and return
  /// the iterations done.
  int conjugate_gradients(const Matrix& matrix, const VectorView& scale,
                          const Precondition& precondition, const double* b, double* x,
                          const Goal& goal);
  int bicgstab(const Matrix& matrix, const Precondition& precondition, const double* b, double* x,
               const Goal& goal);

 private:
  template <int Sums, class F>
  std::array<double, Sums> sum(const F& f);
  template <class F>
  void each(const F& f);
  void multiply(const Matrix& matrix, const double* x, double* y);
  void multiply(const Matrix& matrix, const Precondition& precondition, const double* r, double* z,
                double* y);
  void apply(const Matrix& matrix, const Precondition& precondition, const double* r, double* z);
  double weighted_sum(const double* weights, const double* x);
  double residual(const Matrix& matrix, const double* b, const double* x);
  void start_anew();

  int n_, threads_;
  std::vector<double> partial_;  // sums of each block
  Eigen::VectorXd r_, start_, p_, v_, s_, t_, y_, z_, without_mean_;
};

}  // namespace gradpsi
