#include "solve/iterative.hpp"

#include <functional>
#include <optional>
#include <string>

#include "matrix/checks.hpp"
#include "solve/krylov.hpp"
#include "solve/multigrid.hpp"
#include "solve/row_correction.hpp"

namespace gradpsi {
namespace {

/// Iterations that have to halve the residual where the matrix has reversed rows.
constexpr int trial = 1'000;

class Iterative : public PreparedMethod {
 public:
  void prepare(const LinearSystem& system, const Choice& choice) override {
    if (!krylov_) krylov_.emplace(system.size(), system.options.threads);
    conjugate_ = choice.conjugate;
    by_points_ = choice.preconditioner == Preconditioner::Points;
    reversed_ = false;
    if (by_points_) return multigrid_.prepare(system, !conjugate_);
    walls_.prepare(system, system.points.walls);
    reversed_ = !reversed_rows(system.A).empty();
    inverse_diagonal_ = system.A.diagonal().unaryExpr([](double a) { return a != 0 ? 1 / a : 1; });
  }

  bool solve(const LinearSystem& system, Columns& columns, int most_iterations,
             SolveReport& result) override {
    const Krylov::Precondition precondition = [this, &system](const double* r, double* z) {
      if (by_points_) return multigrid_.apply(system, r, z);
      scale_by_diagonal(r, z);
      walls_.correct(system, r, z);
    };
    const auto iterate = [&](const double* b, double* x, double target, int limit) {
      const auto tell = [&](int iteration, double norm) {
        system.options.progress(result.iterations + iteration,
                                norm / target * system.options.tolerance);
      };
      Krylov::Goal goal{target, limit};
      if (system.options.progress) goal.progress = std::ref(tell);
      return conjugate_
                 ? krylov_->conjugate_gradients(system.A, system.scale, precondition, b, x, goal)
                 : krylov_->bicgstab(system.A, precondition, b, x, goal);
    };
    // A reference, which std::function holds without allocating.
    return iterate_each(system, columns, most_iterations, reversed_ ? trial : most_iterations,
                        result, std::ref(iterate));
  }

  std::string description() const override {
    return std::string(conjugate_ ? "conjugate gradients" : "BiCGSTAB") + " preconditioned by " +
           (by_points_ ? multigrid_.description() : "the diagonal");
  }
  FactorReport factor() const override { return by_points_ ? multigrid_.report() : FactorReport{}; }

 private:
  void scale_by_diagonal(const double* r, double* z) const {
    for (Eigen::Index i = 0; i < inverse_diagonal_.size(); ++i) z[i] = inverse_diagonal_[i] * r[i];
  }

  std::optional<Krylov> krylov_;
  Multigrid multigrid_;
  RowCorrection walls_;
  Eigen::VectorXd inverse_diagonal_;
  bool conjugate_ = false, by_points_ = false, reversed_ = false;
};

}  // namespace

std::unique_ptr<PreparedMethod> make_krylov() { return std::make_unique<Iterative>(); }

}  // namespace gradpsi
