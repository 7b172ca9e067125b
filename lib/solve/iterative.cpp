#include "solve/iterative.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

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
    if (system.floats) strength_ = system.A.diagonal().cwiseAbs().mean() / system.scale.sum();
    by_points_ = choice.preconditioner == Preconditioner::Points;
    reversed_ = false;
    if (std::exchange(is_worn_, false)) multigrid_.give_up();
    if (by_points_) return multigrid_.prepare(system, !conjugate_);
    walls_.prepare(system, system.points.walls);
    reversed_ = !reversed_rows(system.A).empty();
    inverse_diagonal_ = system.A.diagonal().unaryExpr([](double a) { return a != 0 ? 1 / a : 1; });
  }

  bool solve(const LinearSystem& system, Columns& columns, int most_iterations,
             SolveReport& result) override {
    if (by_points_ && multigrid_.is_kept()) {
      start_ = columns.solution;
      if (iterate(system, columns, std::min(most_iterations, 2 * usual_ + 5), result)) {
        is_worn_ = 2 * result.iterations >= 3 * columns.count() * std::max(usual_, 1);
        return true;
      }
      if (!make_anew(system)) return false;
      columns.solution = start_;
      result = {};
    }
    const bool solved = iterate(system, columns, most_iterations, result);
    usual_ = result.iterations / std::max(columns.count(), 1);
    return solved;
  }

  std::string description() const override {
    return std::string(conjugate_ ? "conjugate gradients" : "BiCGSTAB") + " preconditioned by " +
           (by_points_ ? multigrid_.description() : "the diagonal");
  }
  FactorReport factor() const override { return by_points_ ? multigrid_.report() : FactorReport{}; }

 private:
  bool iterate(const LinearSystem& system, Columns& columns, int most_iterations,
               SolveReport& result) {
    const Krylov::Precondition precondition = [this, &system](const double* r, double* z) {
      if (by_points_) return multigrid_.apply(system, r, z);
      scale_by_diagonal(r, z);
      walls_.correct(system, r, z);
    };
    const Krylov::Matrix matrix{system.A, system.floats ? system.scale.data() : nullptr, strength_};
    removed_.setZero(system.floats ? columns.count() : 0);
    const auto iterate = [&](double* b, double* x, double target, int limit) {
      const auto tell = [&](int iteration, double norm) {
        system.options.progress(result.iterations + iteration,
                                norm / target * system.options.tolerance);
      };
      Krylov::Goal goal{target, limit};
      if (system.options.progress) goal.progress = std::ref(tell);
      const int done =
          conjugate_ ? krylov_->conjugate_gradients(matrix, system.scale, precondition, b, x, goal)
                     : krylov_->bicgstab(matrix, precondition, b, x, goal);
      if (system.floats) removed_[(b - columns.rhs.data()) / system.size()] += take(system, b, x);
      return done;
    };
    // A reference, which std::function holds without allocating.
    if (!iterate_each(system, columns, most_iterations, reversed_ ? trial : most_iterations, result,
                      std::ref(iterate))) {
      for (Eigen::Index c = 0; c < removed_.size(); ++c) columns.rhs.col(c).array() += removed_[c];
      return false;
    }
    for (Eigen::Index c = 0; c < removed_.size(); ++c) {
      const double unit = std::ldexp(1.0, columns.units[c]);
      result.removed = std::max(result.removed, std::abs(removed_[c] * unit));
      auto x = columns.solution.col(c);
      x.array() += *system.options.mean / unit - system.scale.dot(x) / system.scale.sum();
    }
    return true;
  }

  /// Coarser points of where the points are by now; false if there can be none.
  bool make_anew(const LinearSystem& system) try {
    multigrid_.give_up();
    multigrid_.prepare(system, !conjugate_);
    return true;
  } catch (const NoHierarchy&) {
    return false;
  }

  /// Takes from b the constant that makes x a solution of A x = b, and x's mean from x; returns the constant.
  double take(const LinearSystem& system, double* b, double* x) const {
    Eigen::Map<Eigen::ArrayXd> right(b, system.size()), solution(x, system.size());
    const double sum = system.scale.dot(solution.matrix()), constant = strength_ * sum;
    right -= constant;
    solution -= sum / system.scale.sum();
    return constant;
  }

  void scale_by_diagonal(const double* r, double* z) const {
    for (Eigen::Index i = 0; i < inverse_diagonal_.size(); ++i) z[i] = inverse_diagonal_[i] * r[i];
  }

  std::optional<Krylov> krylov_;
  Multigrid multigrid_;
  RowCorrection walls_;
  Eigen::VectorXd inverse_diagonal_;
  double strength_ = 0;  // of the mean's own equation, where constants are in the null space
  DenseVector removed_;  // from each right-hand side
  Eigen::MatrixXd start_;
  int usual_ = 0;         // iterations on the coarser points when they were new
  bool is_worn_ = false;  // these are half as many again by now
  bool conjugate_ = false, by_points_ = false, reversed_ = false;
};

}  // namespace

std::unique_ptr<PreparedMethod> make_krylov() { return std::make_unique<Iterative>(); }

}  // namespace gradpsi
