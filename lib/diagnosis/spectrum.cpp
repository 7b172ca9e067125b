#include "gradpsi/spectrum.hpp"

#include <Spectra/GenEigsSolver.h>

#include <algorithm>
#include <string>

#include "base/parallel.hpp"
#include "diagnosis/eigenvalues.hpp"
#include "diagnosis/matrix.hpp"
#include "gradpsi/error.hpp"
#include "matrix/checks.hpp"

namespace gradpsi {
namespace {

/// x -> A x - shift x, as Spectra calls it.
struct Shifted {
  using Scalar = double;
  Eigen::Index rows() const { return A.rows(); }
  Eigen::Index cols() const { return A.cols(); }
  void perform_op(const double* x, double* y) const {
    // Eigen's product would take as many threads as OpenMP offers.
    parallel_chunks(static_cast<int>(A.rows()), 1024, threads, [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        double sum = 0;
        for (SparseMatrix::InnerIterator a(A, i); a; ++a) sum += a.value() * x[a.col()];
        y[i] = sum - shift * x[i];
      }
    });
  }
  const SparseMatrix& A;
  double shift;
  int threads;
};

/// An outermost eigenvalue. Convergence is judged relative to the eigenvalue, so the origin is shifted to the
/// other end of the spectrum: one near zero need not have as many digits as the matrix is large.
std::complex<double> outermost(const SparseMatrix& A, Spectra::SortRule rule, double shift,
                               int threads) {
  constexpr int wanted = 1, subspace = 60, restarts = 1000;
  constexpr double tolerance = 1e-7;
  Shifted shifted{A, shift, threads};
  Spectra::GenEigsSolver<Shifted> solver(shifted, wanted, subspace);
  solver.init();
  solver.compute(rule, restarts, tolerance);
  if (solver.info() != Spectra::CompInfo::Successful)
    throw SolverError("the outermost eigenvalues did not converge in " + std::to_string(restarts) +
                      " restarts of the Arnoldi iteration");
  return solver.eigenvalues()[0] + shift;
}

}  // namespace

double Spectrum::rightmost() const { return values.size() > 0 ? values.real().maxCoeff() : 0; }
double Spectrum::leftmost() const { return values.size() > 0 ? values.real().minCoeff() : 0; }
double Spectrum::widest() const { return values.size() > 0 ? values.imag().maxCoeff() : 0; }

Spectrum spectrum(const SparseMatrix& A, const DenseVector& volumes, int complete_below,
                  int threads) {
  const int n = static_cast<int>(A.rows());
  checked_threads(threads);
  if (A.cols() != n || (volumes.size() != 0 && volumes.size() != n))
    throw InvalidInput("a matrix of " + std::to_string(n) + " rows, " + std::to_string(A.cols()) +
                       " columns and " + std::to_string(volumes.size()) + " volumes");
  Spectrum result;
  if (n == 0) return result;
  result.zero = slow_growth * median_diagonal(DenseVector(A.diagonal()));
  if (n <= std::max(complete_below, 100)) {
    if (volumes.size() > 0 && is_symmetric(A, volumes))
      result.values = eigenvalues(A, volumes).cast<std::complex<double>>();
    else
      result.values = eigenvalues(A);
  } else {
    result.complete = false;
    const MatrixSummary bounds = summarise(A, DenseVector::Ones(n));
    result.values.resize(2);
    result.values[0] = outermost(A, Spectra::SortRule::LargestReal, bounds.leftmost, threads);
    result.values[1] = outermost(A, Spectra::SortRule::SmallestReal, bounds.rightmost, threads);
  }
  return result;
}

}  // namespace gradpsi
