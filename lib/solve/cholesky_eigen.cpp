// Cholesky without CHOLMOD: Eigen's simplicial factorisation. It cannot tell beforehand what memory
// it will take, and allocates in every solve.

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <utility>

#include "base/stopwatch.hpp"
#include "solve/cholesky.hpp"

namespace gradpsi {

struct Cholesky::State {
  using Columns = Eigen::SparseMatrix<double>;

  /// The lower triangle of diag(scale) A, its rows and columns in the order of elimination.
  Columns permuted(const SparseMatrix& A) const {
    const SparseMatrix upper = (scale.asDiagonal() * A).triangularView<Eigen::Upper>();
    const Columns lower = upper.transpose();
    Columns result(A.rows(), A.cols());
    result.selfadjointView<Eigen::Lower>() = lower.selfadjointView<Eigen::Lower>().twistedBy(order);
    return result;
  }

  Eigen::VectorXd scale;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;  // unknown to its place
  Eigen::SimplicialLLT<Columns, Eigen::Lower, Eigen::NaturalOrdering<int>> llt;
  FactorReport report;
};

Cholesky::Cholesky(const SparseMatrix& A, Eigen::VectorXd scale, const Elimination& elimination,
                   double, int)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  Stopwatch watch;
  s.scale = std::move(scale);
  if (elimination.permutation.size() > 0) {
    s.order.indices() = elimination.permutation;
  } else {
    const State::Columns columns = A;
    Eigen::AMDOrdering<int>()(columns, s.order);
  }
  s.order = s.order.inverse();
  s.llt.analyzePattern(s.permuted(A));
  s.report = {
      .description = "Eigen, ordered by " +
                     std::string(name(elimination.permutation.size() > 0 ? Ordering::Coordinates
                                                                         : Ordering::Amd)),
      .analyse_seconds = elimination.seconds + watch.lap()};
}

Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;
Cholesky::~Cholesky() = default;

bool Cholesky::factorise(const SparseMatrix& A) {
  State& s = *state_;
  Stopwatch watch;
  s.llt.factorize(s.permuted(A));
  if (s.llt.info() != Eigen::Success) return false;
  const auto& L = s.llt.matrixL().nestedExpression();
  s.report.entries = static_cast<double>(L.nonZeros());
  s.report.flops = 0;
  for (Eigen::Index j = 0; j < L.cols(); ++j) {
    const double count = L.outerIndexPtr()[j + 1] - L.outerIndexPtr()[j];
    s.report.flops += count * count;
  }
  s.report.bytes = 12 * s.report.entries;
  s.report.factor_seconds = watch.lap();
  return true;
}

void Cholesky::solve(const double* b, double* x, int columns) {
  State& s = *state_;
  const Eigen::Index n = s.scale.size();
  const Eigen::Map<const Eigen::MatrixXd> right(b, n, columns);
  const Eigen::MatrixXd permuted = s.order * (s.scale.asDiagonal() * right);
  Eigen::Map<Eigen::MatrixXd>(x, n, columns) = s.order.inverse() * s.llt.solve(permuted);
}

const FactorReport& Cholesky::report() const { return state_->report; }

}  // namespace gradpsi
