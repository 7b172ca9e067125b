// LU without UMFPACK: Eigen's supernodal factorisation, which finds its own order. It cannot tell
// beforehand what memory it will take, and allocates in every solve.

#include <Eigen/SparseLU>

#include "base/stopwatch.hpp"
#include "gradpsi/error.hpp"
#include "solve/lu.hpp"

namespace gradpsi {

struct Lu::State {
  Eigen::SparseLU<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> lu;
  FactorReport report;
};

Lu::Lu(const SparseMatrix& A, const Elimination&, double, int) : state_(std::make_unique<State>()) {
  Stopwatch watch;
  state_->lu.analyzePattern(A);
  state_->report = {.description = "Eigen, ordered by COLAMD", .analyse_seconds = watch.lap()};
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
  s.report.entries = static_cast<double>(s.lu.nnzL() + s.lu.nnzU());
  s.report.bytes = 12 * s.report.entries;
  s.report.factor_seconds = watch.lap();
}

void Lu::solve(const double* b, double* x, int columns) {
  const Eigen::Index n = state_->lu.rows();
  const Eigen::Map<const Eigen::MatrixXd> right(b, n, columns);
  Eigen::Map<Eigen::MatrixXd>(x, n, columns) = state_->lu.solve(right);
}

const FactorReport& Lu::report() const { return state_->report; }

}  // namespace gradpsi
