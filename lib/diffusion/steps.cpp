#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/resize.hpp"
#include "diffusion/conditions.hpp"
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

/// A steady problem is solved once.
SolverOptions solver_options(const DiffusionOptions& options) {
  SolverOptions result = options.solver;
  if (std::isinf(options.time_step) && result.solves == 0) result.solves = 1;
  return result;
}

/// By the theta method, or half as long by backward Euler.
enum class Step { Whole, Half };

}  // namespace

struct ImplicitDiffusion::State {
  State(const Cloud& cloud, const Operator& laplacian, const BoundaryConditions& conditions,
        const DiffusionOptions& given)
      : options(given),
        system(cloud, with_all_rows(laplacian), conditions, options),
        solver(system.take_matrix(), solver_options(options), system.take_points()),
        points(cloud.size()) {}

  SolveReport advance(Eigen::Ref<Eigen::MatrixXd> u, Step kind);
  void set_right_hand_side(Eigen::Index column, std::span<const double> u, Step kind);

  DiffusionOptions options;  // as they are by now
  DiffusionSystem system;
  LinearSolver solver;
  int points;
  DenseVector product;  // workspace of step()
  DenseMatrix rhs, solution;
};

/// Also what iterations start from.
void ImplicitDiffusion::State::set_right_hand_side(Eigen::Index column, std::span<const double> u,
                                                   Step kind) {
  const std::vector<int>& unknowns = system.rows();
  double* const now = solution.col(column).data();
  for (Eigen::Index k = 0; k < rhs.rows(); ++k) now[k] = u[unknowns[k]];
  if (kind == Step::Half) return system.damped_right_hand_side(u, span(rhs.col(column)));
  if (system.needs_product())
    for_each_product(solver.matrix(), now, options.solver.threads,
                     [&](int k, double value) { product[k] = value; });
  system.right_hand_side(u, span(product), span(rhs.col(column)));
}

SolveReport ImplicitDiffusion::State::advance(Eigen::Ref<Eigen::MatrixXd> u, Step kind) {
  if (u.rows() != points)
    throw InvalidInput("the field has " + std::to_string(u.rows()) + " rows for " +
                       std::to_string(points) + " points");
  const std::vector<int>& unknowns = system.rows();
  if (solver.matrix().rows() != std::ssize(unknowns))
    throw SolverError("there is nothing to step with: the latest update() failed");
  resize(rhs, static_cast<Eigen::Index>(unknowns.size()), u.cols());
  resize(solution, rhs.rows(), rhs.cols());
  if (system.needs_product()) resize(product, rhs.rows());
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (int i = 0; i < points; ++i)
      if (!std::isfinite(u(i, c)))
        throw InvalidInput("the field is not finite at point " + std::to_string(i));
    set_right_hand_side(c, span(u.col(c)), kind);
  }
  const SolveReport report = solver.solve(rhs, solution);
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (Eigen::Index k = 0; k < rhs.rows(); ++k) u(unknowns[k], c) = solution(k, c);
    system.set_fixed(span(u.col(c)));
  }
  return report;
}

ImplicitDiffusion::ImplicitDiffusion(const Cloud& cloud, const Operator& laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : state_(std::make_unique<State>(cloud, laplacian, conditions, options)) {}

ImplicitDiffusion::ImplicitDiffusion(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion& ImplicitDiffusion::operator=(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion::~ImplicitDiffusion() = default;

void ImplicitDiffusion::set_source(const VectorView& source) {
  state_->system.set_source(source);
  state_->options.source = source;
}

void ImplicitDiffusion::set_fixed_values(DenseVector values) {
  state_->system.set_fixed_values(std::move(values));
}

void ImplicitDiffusion::set_flux(const VectorView& flux) { state_->system.set_flux(flux); }

void ImplicitDiffusion::set_time_step(double time_step) {
  SparseMatrix matrix = state_->solver.matrix();
  state_->system.set_time_step(time_step, matrix);
  state_->options.time_step = time_step;
  state_->solver.refactor(matrix.markAsRValue());  // Eigen 3.4 would copy
}

void ImplicitDiffusion::update(const Cloud& cloud, const Operator& laplacian,
                               const BoundaryConditions& conditions) {
  State& s = *state_;
  DiffusionSystem next(cloud, with_all_rows(laplacian), conditions, s.options);
  s.system = std::move(next);
  s.points = cloud.size();
  s.solver.update(s.system.take_matrix(), s.system.take_points());
}

SolveReport ImplicitDiffusion::step(Eigen::Ref<Eigen::MatrixXd> u) {
  return state_->advance(u, Step::Whole);
}

SolveReport ImplicitDiffusion::damped_step(Eigen::Ref<Eigen::MatrixXd> u) {
  check_damping(state_->options.theta);
  DenseMatrix next = u;
  const SolveReport first = state_->advance(next, Step::Half);
  const SolveReport second = state_->advance(next, Step::Half);
  u = next;
  return both(first, second);
}

const SolverReport& ImplicitDiffusion::solver() const { return state_->solver.report(); }

}  // namespace gradpsi
