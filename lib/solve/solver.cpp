#include "gradpsi/solver.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "base/resize.hpp"
#include "base/stopwatch.hpp"
#include "gradpsi/error.hpp"
#include "matrix/checks.hpp"
#include "multigrid/hierarchy.hpp"
#include "solve/errors.hpp"
#include "solve/factor.hpp"
#include "solve/methods.hpp"
#include "solve/pinned.hpp"

namespace gradpsi {
namespace {

double machine_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

void check(const SparseMatrix& A, const SystemPoints& points, const SolverOptions& options) {
  const Eigen::Index n = A.rows();
  if (n != A.cols() || !A.isCompressed())
    throw InvalidInput("the matrix must be square and compressed, not " + std::to_string(n) +
                       " x " + std::to_string(A.cols()));
  if (points.cloud.size() > 0 && points.cloud.size() != n)
    throw InvalidInput("there are " + std::to_string(points.cloud.size()) + " points for " +
                       std::to_string(n) + " rows");
  std::vector<char> is_wall(n, false);
  for (const int i : points.walls)
    if (i < 0 || i >= n || std::exchange(is_wall[i], true))
      throw InvalidInput("wall row " + std::to_string(i) + " is not one of " + std::to_string(n) +
                         " rows, or there twice");
  check_options(options);
  checked_threads(options.threads);
}

/// Returns whether constants are in the null space, which is what a mean was given for.
bool check_matrix(const LinearSystem& system) {
  check_rows(system.A, [&](int i) { return system.row(i); });
  const FloatingRows rows = floating_rows(system.A);
  if (rows.count == system.size() && system.size() > 1 && system.options.mean) return true;
  if (rows.count > 0) throw floating(rows.count, system.row(rows.first));
  return false;
}

void check(const LinearSystem& system, const Eigen::Ref<const Eigen::MatrixXd>& b,
           const Eigen::Ref<const Eigen::MatrixXd>& x) {
  const int n = system.size();
  if (b.rows() != n || x.rows() != n || b.cols() != x.cols())
    throw InvalidInput("b is " + std::to_string(b.rows()) + " x " + std::to_string(b.cols()) +
                       " and x " + std::to_string(x.rows()) + " x " + std::to_string(x.cols()) +
                       " for a matrix of " + std::to_string(n) + " rows");
  for (Eigen::Index c = 0; c < b.cols(); ++c)
    for (int i = 0; i < n; ++i)
      if (!std::isfinite(b(i, c)) || !std::isfinite(x(i, c)))
        throw InvalidInput("the right-hand side or the start is not finite at " + system.row(i));
}

/// SolverReport::caution
std::string caution(const LinearSystem& system) {
  const std::vector<int> rows = reversed_rows(system.A);
  if (rows.empty()) return "";
  constexpr std::size_t named = 3;
  std::string text = "of " + std::to_string(rows.size()) + (rows.size() == 1 ? " row" : " rows") +
                     " the diagonal entry has not the sign of most, as where a field grows: ";
  for (std::size_t k = 0; k < std::min(rows.size(), named); ++k)
    text += (k > 0 ? ", " : "") + system.row(rows[k]);
  return text + (rows.size() > named ? ", .." : "");
}

}  // namespace

struct LinearSolver::State {
  State(SparseMatrix&& matrix, const SolverOptions& options, SystemPoints&& points);

  void take(SparseMatrix& matrix);
  void set_up();
  void use(const Choice& next);
  bool has_successor();
  void solve(SolveReport& result);

  LinearSystem system;
  Choice choice;           // of what is prepared
  bool is_pinned = false;  // what is prepared holds an unknown
  std::unique_ptr<PreparedMethod> prepared;
  SolverReport report;  // of Method::Auto: there is nothing to solve with
  Columns columns;
  Eigen::MatrixXd start;  // what the successor starts from
};

LinearSolver::State::State(SparseMatrix&& matrix, const SolverOptions& options,
                           SystemPoints&& points)
    : system{.points = std::move(points), .options = options} {
  check(matrix, system.points, options);
  if (!(options.memory > 0)) system.options.memory = 0.75 * machine_memory();
  take(matrix);
  set_up();
}

/// Takes a matrix of the points in.
void LinearSolver::State::take(SparseMatrix& matrix) {
  system.A.swap(matrix);  // Eigen 3.4 would copy
  const Cloud& cloud = system.points.cloud;
  system.scale = cloud.has_volumes() ? cloud.volumes() : Eigen::VectorXd::Ones(system.size());
}

/// Prepares the first method that serves, what is learnt from one in vain helping to choose the next.
void LinearSolver::State::set_up() {
  Stopwatch watch;
  report = {};  // should any of this throw
  if (system.size() == 0) {
    report = {Method::Krylov, "nothing", "there are no unknowns", 0, {}, true};
    return;
  }
  system.floats = check_matrix(system);
  const Method asked = system.options.method;
  const Cloud& cloud = system.points.cloud;
  if (cloud.has_volumes())
    system.diffusivities =
        row_diffusivities(system.A, cloud, system.diagonal(), system.options.threads);
  Traits known = traits(system);
  std::vector<Refusal> refused;
  while (report.method == Method::Auto) {
    const Choice next = choose(known, asked, refused);
    try {
      use(next);
    } catch (const Indefinite&) {
      if (asked != Method::Auto) throw;
      known.indefinite = true;
    } catch (const FactorTooLarge& error) {
      if (asked != Method::Auto)
        throw SolverError(std::string(name(asked)) + ": " + error.what() + "; krylov takes little");
      refused.push_back({next.method, error.what()});
    } catch (const NoHierarchy& error) {
      if (asked == Method::Multigrid) throw SolverError(std::string("multigrid: ") + error.what());
      refused.push_back({Method::Multigrid, error.what()});
    } catch (const std::bad_alloc&) {
      if (asked != Method::Auto || next.method != Method::Lu) throw;
      refused.push_back({next.method});
    }
  }
  report.setup_seconds = watch.lap();
}

/// Prepares a method and lets go of the one before; of itself, too, should it throw.
void LinearSolver::State::use(const Choice& next) {
  const bool pin = system.floats && !iterates(next.method);
  const bool again = prepared && choice.method == next.method && is_pinned == pin;
  std::unique_ptr<PreparedMethod> made = again ? std::move(prepared) : row_of(next.method).make();
  if (pin && !again) made = pinned(std::move(made));
  is_pinned = pin;
  made->prepare(system, next);
  prepared = std::move(made);
  choice = next;
  report = {next.method,   prepared->description(), next.reason,
            system.size(), prepared->factor(),      iterates(next.method)};
  if (report.iterates && next.preconditioner == Preconditioner::Diagonal)
    report.caution = caution(system);
}

/// Whether what takes over from the choice fits the memory, and is prepared then.
bool LinearSolver::State::has_successor() {
  try {
    use(successor(choice));
    return true;
  } catch (const FactorTooLarge&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void LinearSolver::State::solve(SolveReport& result) {
  const int most = system.options.max_iterations;
  if (choice.provisional) {
    resize(start, columns.solution.rows(), columns.solution.cols());
    start = columns.solution;
  }
  if (prepared->solve(system, columns, most_iterations(choice, system.options), result)) return;
  if (choice.provisional) {
    columns.solution = start;
    result = {};
    has_successor();  // if there is none, the same goes on for longer
    if (prepared->solve(system, columns, most, result)) return;
  }
  throw unsolved(report, result);
}

LinearSolver::LinearSolver(SparseMatrix matrix, SolverOptions options, SystemPoints points)
    : state_(std::make_unique<State>(std::move(matrix), options, std::move(points))) {}

LinearSolver::LinearSolver(LinearSolver&&) noexcept = default;
LinearSolver& LinearSolver::operator=(LinearSolver&&) noexcept = default;
LinearSolver::~LinearSolver() = default;

void LinearSolver::refactor(SparseMatrix matrix) {
  if (!share_pattern(matrix, state_->system.A))
    throw InvalidInput("refactor needs a matrix of the pattern that was analysed");
  state_->system.A.swap(matrix);
  state_->set_up();
}

void LinearSolver::update(SparseMatrix matrix, SystemPoints points) {
  State& s = *state_;
  s.report = {};  // should any of this throw
  check(matrix, points, s.system.options);
  // A factor's analysis is of a pattern; iterations know but the number of unknowns.
  if (matrix.rows() != s.system.size() || !iterates(s.choice.method)) s.prepared.reset();
  s.system.points = std::move(points);
  s.take(matrix);
  s.set_up();
}

SolveReport LinearSolver::solve(const Eigen::Ref<const Eigen::MatrixXd>& b,
                                Eigen::Ref<Eigen::MatrixXd> x) {
  State& s = *state_;
  Stopwatch watch;
  check(s.system, b, x);
  SolveReport result;
  if (s.report.method == Method::Auto)
    throw SolverError("there is no factor: the latest refactor() or update() failed");
  if (s.system.size() == 0 || b.cols() == 0) return result;
  s.columns.take(b, x);
  s.solve(result);
  s.columns.give(x);
  result.seconds = watch.lap();
  return result;
}

const SolverReport& LinearSolver::report() const { return state_->report; }
const SparseMatrix& LinearSolver::matrix() const { return state_->system.A; }

}  // namespace gradpsi
