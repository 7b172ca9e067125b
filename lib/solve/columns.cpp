#include "solve/columns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/resize.hpp"
#include "matrix/csr.hpp"
#include "solve/residual.hpp"

namespace gradpsi {
namespace {

/// The 2-norm of |b| + |A| |x|.
double size_of_terms(const SparseMatrix& A, const double* b, const double* x) {
  double squared = 0;
  for (int i = 0; i < A.rows(); ++i) {
    double terms = std::abs(b[i]);
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) terms += std::abs(a.value() * x[a.col()]);
    squared += terms * terms;
  }
  return std::sqrt(squared);
}

/// Whether column c, whose right-hand side had that 2-norm, holds a solution. That of b - A x is left in `relative`,
/// relative to it unless it is 0, and b - A x in the residuals.
bool is_solution(const LinearSystem& system, Columns& columns, int c, double size,
                 double& relative) {
  const double* const b = columns.rhs.col(c).data();
  const double* const x = columns.solution.col(c).data();
  const double norm =
      residual(system.A, b, x, columns.residuals.col(c).data(), system.options.threads);
  relative = size > 0 ? norm / size : norm;
  return is_solved(norm, size, system.options.tolerance,
                   [&] { return size_of_terms(system.A, b, x); });
}

}  // namespace

void Columns::take(const Eigen::Ref<const Eigen::MatrixXd>& b,
                   const Eigen::Ref<const Eigen::MatrixXd>& x) {
  for (Eigen::MatrixXd* matrix : {&rhs, &solution, &residuals, &corrections})
    resize(*matrix, b.rows(), b.cols());
  resize(units, b.cols());
  for (Eigen::Index c = 0; c < b.cols(); ++c) {
    units[c] = unit_of(b.col(c).cwiseAbs().maxCoeff());
    for (Eigen::Index i = 0; i < b.rows(); ++i) {
      rhs(i, c) = std::ldexp(b(i, c), -units[c]);
      solution(i, c) = std::ldexp(x(i, c), -units[c]);
    }
  }
  if (!solution.allFinite()) solution.setZero();  // a start that far off is none
}

void Columns::give(Eigen::Ref<Eigen::MatrixXd> x) const {
  for (Eigen::Index c = 0; c < x.cols(); ++c)
    for (Eigen::Index i = 0; i < x.rows(); ++i) x(i, c) = std::ldexp(solution(i, c), units[c]);
}

bool refine(const LinearSystem& system, Columns& columns, SolveReport& result,
            const std::function<void(const Eigen::MatrixXd&, Eigen::MatrixXd&)>& approximate) {
  approximate(columns.rhs, columns.solution);
  for (;; ++result.iterations) {
    bool good = true;
    result.residual = 0;
    for (int c = 0; c < columns.count(); ++c) {
      double residual;
      good = is_solution(system, columns, c, columns.rhs.col(c).norm(), residual) && good;
      if (!(residual <= result.residual)) result.residual = residual;  // NaN, too
    }
    if (good || result.iterations == 2) return good;
    approximate(columns.residuals, columns.corrections);
    columns.solution += columns.corrections;
  }
}

bool iterate_each(const LinearSystem& system, Columns& columns, int most_iterations, int at_a_time,
                  SolveReport& result,
                  const std::function<int(double*, double*, double, int)>& iterate) {
  double worst = 0;
  for (int c = 0; c < columns.count(); ++c) {
    const double size = columns.rhs.col(c).norm(), target = system.options.tolerance * size;
    if (target == 0) columns.solution.col(c).setZero();
    int left = most_iterations;
    double residual, before = std::numeric_limits<double>::infinity();
    while (!is_solution(system, columns, c, size, residual)) {
      result.residual = residual;
      if (left == 0 || !(residual < before / 2)) return false;
      before = residual;
      const int done = iterate(columns.rhs.col(c).data(), columns.solution.col(c).data(), target,
                               std::min(left, at_a_time));
      result.iterations += done;
      left -= done;
    }
    worst = std::max(worst, residual);
  }
  result.residual = worst;
  return true;
}

}  // namespace gradpsi
