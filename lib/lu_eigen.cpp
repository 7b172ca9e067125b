// LU without UMFPACK: Eigen's supernodal factorisation, which finds its own order. It cannot tell
// beforehand what memory it will take, and allocates in every solve.

#include <Eigen/SparseLU>
#include <limits>

#include "gradpsi/error.hpp"
#include "lu.hpp"
#include "stopwatch.hpp"

namespace gradpsi {

struct Lu::State {
  Eigen::SparseLU<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> lu;
  FactorStatistics statistics;
};

Lu::Lu(const SparseMatrix& A, const Elimination&, int) : state_(std::make_unique<State>()) {
  Stopwatch watch;
  state_->lu.analyzePattern(A);
  state_->statistics = {.description = "Eigen, ordered by COLAMD", .analyse_seconds = watch.lap()};
}

Lu::Lu(Lu&&) noexcept = default;
Lu& Lu::operator=(Lu&&) noexcept = default;
Lu::~Lu() = default;

void Lu::factorise(const SparseMatrix& A) {
  State& s = *state_;
  Stopwatch watch;
  s.lu.factorize(A);
  if (s.lu.info() != Eigen::Success)
    throw SolverError("the matrix is singular: " + s.lu.lastErrorMessage());
  s.statistics.entries = static_cast<double>(s.lu.nnzL() + s.lu.nnzU());
  s.statistics.bytes = 12 * s.statistics.entries;
  s.statistics.factor_seconds = watch.lap();
}

void Lu::solve(const double* b, double* x, int columns) {
  const Eigen::Index n = state_->lu.rows();
  const Eigen::Map<const Eigen::MatrixXd> right(b, n, columns);
  Eigen::Map<Eigen::MatrixXd>(x, n, columns) = state_->lu.solve(right);
}

const FactorStatistics& Lu::statistics() const { return state_->statistics; }

}  // namespace gradpsi
