#include "solve/iterative.hpp"

#include <functional>
#include <optional>

#include "matrix/checks.hpp"
#include "solve/cholesky.hpp"
#include "solve/krylov.hpp"
#include "solve/ordering.hpp"
#include "solve/twin.hpp"
#include "solve/walls.hpp"

namespace gradpsi {
namespace {

/// Iterations that have to halve the residual where the matrix has reversed rows.
constexpr int trial = 1'000;

class Iterative : public PreparedMethod {
 public:
  void prepare(const LinearSystem& system, const Choice& choice) override {
    if (!krylov_) krylov_.emplace(system.size(), system.options.threads);
    conjugate_ = choice.conjugate;
    walls_.prepare(system);
    reversed_ = !reversed_rows(system.A).empty();
    by_twin_ = choice.preconditioner == Preconditioner::Twin && factorise_twin(system);
    if (!by_twin_)
      inverse_diagonal_ =
          system.A.diagonal().unaryExpr([](double a) { return a != 0 ? 1 / a : 1; });
  }

  bool solve(const LinearSystem& system, Columns& columns, int most_iterations,
             SolveReport& result) override {
    const Krylov::Precondition precondition = [this, &system](const double* r, double* z) {
      by_twin_ ? twin_->solve(r, z, 1) : scale_by_diagonal(r, z);
      walls_.correct(system, r, z);
    };
    const auto iterate = [&](const double* b, double* x, double target, int limit) {
      return conjugate_ ? krylov_->conjugate_gradients(system.A, system.scale, precondition, b, x,
                                                       target, limit)
                        : krylov_->bicgstab(system.A, precondition, b, x, target, limit);
    };
    // A reference, which std::function holds without allocating.
    return iterate_each(system, columns, most_iterations, reversed_ ? trial : most_iterations,
                        result, std::ref(iterate));
  }

  std::string description() const override {
    return std::string(conjugate_ ? "conjugate gradients" : "BiCGSTAB") +
           " preconditioned by the " +
           (by_twin_ ? "factor (" + twin_->report().description + ") of a compact symmetric twin"
                     : "diagonal");
  }
  FactorReport factor() const override { return by_twin_ ? twin_->report() : FactorReport{}; }

 private:
  /// Whether the twin fits the memory and is positive definite.
  bool factorise_twin(const LinearSystem& system) {
    const auto& [A, points, options, scale] = system;
    const std::vector<int> diagonal = system.diagonal();
    SparseMatrix matrix;
    compact_twin(A, points.cloud, diagonal,
                 twin_scales(A, points.cloud, diagonal, points.walls, options.threads),
                 options.threads, matrix);
    try {
      if (!twin_)
        twin_.emplace(matrix, scale, elimination(system, matrix), options.memory, options.threads);
      return twin_->factorise(matrix);
    } catch (const FactorTooLarge&) {
      return false;
    }
  }

  void scale_by_diagonal(const double* r, double* z) const {
    for (Eigen::Index i = 0; i < inverse_diagonal_.size(); ++i) z[i] = inverse_diagonal_[i] * r[i];
  }

  std::optional<Krylov> krylov_;
  std::optional<Cholesky> twin_;
  WallCorrection walls_;
  Eigen::VectorXd inverse_diagonal_;
  bool conjugate_ = false, by_twin_ = false, reversed_ = false;
};

}  // namespace

std::unique_ptr<PreparedMethod> make_krylov() { return std::make_unique<Iterative>(); }

}  // namespace gradpsi
