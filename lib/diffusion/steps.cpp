#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "base/resize.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/system.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

const Operator& with_all_rows(const Operator& laplacian) {
  if (!laplacian.points.empty())
    throw InvalidInput("the Laplacian has " + std::to_string(laplacian.points.size()) +
                       " rows that were asked for; implicit diffusion needs all");
  return laplacian;
}

/// The numbers of a vector or column.
template <class Column>
auto span(Column&& column) {
  return std::span(column.data(), static_cast<std::size_t>(column.size()));
}

}  // namespace

struct ImplicitDiffusion::State {
  State(const Cloud& cloud, const Operator& laplacian, const BoundaryConditions& conditions,
        const DiffusionOptions& options)
      : points(cloud.size()),
        system(cloud, with_all_rows(laplacian), conditions, options),
        solver(system.take_matrix(), options.solver, system.take_points()),
        threads(options.solver.threads) {}

  void set_right_hand_side(Eigen::Index column, std::span<const double> u);

  int points;
  DiffusionSystem system;
  LinearSolver solver;
  int threads;
  DenseVector product;  // workspace of step()
  DenseMatrix rhs, solution;
};

/// Also what iterations start from.
void ImplicitDiffusion::State::set_right_hand_side(Eigen::Index column, std::span<const double> u) {
  const std::vector<int>& unknowns = system.rows();
  double* const now = solution.col(column).data();
  for (Eigen::Index k = 0; k < rhs.rows(); ++k) now[k] = u[unknowns[k]];
  if (system.needs_product())
    for_each_product(solver.matrix(), now, threads,
                     [&](int k, double value) { product[k] = value; });
  system.right_hand_side(u, span(product), span(rhs.col(column)));
}

ImplicitDiffusion::ImplicitDiffusion(const Cloud& cloud, const Operator& laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : state_(std::make_unique<State>(cloud, laplacian, conditions, options)) {}

ImplicitDiffusion::ImplicitDiffusion(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion& ImplicitDiffusion::operator=(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion::~ImplicitDiffusion() = default;

void ImplicitDiffusion::set_time_step(double time_step) {
  SparseMatrix matrix = state_->solver.matrix();
  state_->system.set_time_step(time_step, matrix);
  state_->solver.refactor(matrix.markAsRValue());  // Eigen 3.4 would copy
}

SolveReport ImplicitDiffusion::step(Eigen::Ref<Eigen::MatrixXd> u) {
  State& s = *state_;
  if (u.rows() != s.points)
    throw InvalidInput("the field has " + std::to_string(u.rows()) + " rows for " +
                       std::to_string(s.points) + " points");
  const std::vector<int>& unknowns = s.system.rows();
  resize(s.rhs, static_cast<Eigen::Index>(unknowns.size()), u.cols());
  resize(s.solution, s.rhs.rows(), s.rhs.cols());
  if (s.system.needs_product()) resize(s.product, s.rhs.rows());
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (int i = 0; i < s.points; ++i)
      if (!std::isfinite(u(i, c)))
        throw InvalidInput("the field is not finite at point " + std::to_string(i));
    s.set_right_hand_side(c, span(u.col(c)));
  }
  const SolveReport report = s.solver.solve(s.rhs, s.solution);
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (Eigen::Index k = 0; k < s.rhs.rows(); ++k) u(unknowns[k], c) = s.solution(k, c);
    s.system.set_fixed(span(u.col(c)));
  }
  return report;
}

const SolverReport& ImplicitDiffusion::solver() const { return state_->solver.report(); }

}  // namespace gradpsi
