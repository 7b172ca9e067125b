#include "gradpsi/solver.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "base/median.hpp"
#include "base/resize.hpp"
#include "base/stopwatch.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "matrix/checks.hpp"
#include "matrix/csr.hpp"
#include "solve/cholesky.hpp"
#include "solve/errors.hpp"
#include "solve/krylov.hpp"
#include "solve/lu.hpp"
#include "solve/ordering.hpp"
#include "solve/twin.hpp"

namespace gradpsi {
namespace {

// Where methods cross over, measured in benchmarks/README.md.
constexpr double mild = 3;        // dt nu / dx^2 up to which the diagonal preconditions well
constexpr double stiff = 100;     // and above which a factor of a twin does better
constexpr int always_lu = 2'000;  // unknowns
constexpr int most_lu = 300'000;  // in one and two dimensions
constexpr int most_lu_3d = 20'000;

constexpr std::array<std::pair<Method, std::string_view>, 4> method_names = {
    {{Method::Auto, "auto"},
     {Method::Cholesky, "cholesky"},
     {Method::Lu, "lu"},
     {Method::Krylov, "krylov"}}};

double machine_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::string_view name(Method method) {
  return std::ranges::find(method_names, method, &std::pair<Method, std::string_view>::first)
      ->second;
}

std::string_view name(Ordering ordering) {
  switch (ordering) {
    case Ordering::Coordinates: return "nested dissection by coordinates";
    case Ordering::Amd: return "AMD";
    case Ordering::Metis: return "METIS";
  }
  return {};
}

Method method(std::string_view name) {
  std::vector<std::string> valid;
  for (const auto& [method, its_name] : method_names) {
    if (its_name == name) return method;
    valid.emplace_back(its_name);
  }
  throw_unknown("method", name, valid);
}

FactorTooLarge::FactorTooLarge(double needed, double given)
    : std::runtime_error("its factor would take " + rounded(needed / 1e9) + " GB of the " +
                         rounded(given / 1e9) + " GB given") {}

struct LinearSolver::State {
  State(SparseMatrix&& matrix, const SolverOptions& options, SystemPoints system);

  // Setting up
  void check() const;
  void check_matrix() const;
  void set_up();
  void set_up_auto();
  bool set_up_cholesky(const std::string& reason);
  void set_up_lu(const std::string& reason);
  bool lu_fits(std::string& reason);
  void set_up_krylov(const std::string& reason);
  bool factorise_twin();
  void factorise_walls();
  double stiffness() const;
  Elimination elimination(const SparseMatrix& matrix) const;
  void choose(Method method, const std::string& description, const std::string& reason,
              const FactorReport& factor = {});
  bool has_points() const { return points.cloud.size() > 0; }
  std::string row(int i) const;
  std::vector<int> all_rows() const;

  // Solving
  bool is_solution(int column, double& residual);
  void solve_directly(SolveReport& result);
  void iterate(SolveReport& result, int limit);
  void iterate_or_factorise(SolveReport& result);
  void correct_walls(const double* r, double* z);

  SparseMatrix A;
  SystemPoints points;
  SolverOptions options;
  int n;
  Eigen::VectorXd scale;  // the points' volumes, or 1
  bool symmetric = false;
  double ratio = 0;  // stiffness()
  std::optional<Cholesky> cholesky, twin;
  std::optional<Lu> lu, walls;
  std::optional<Krylov> krylov;
  bool conjugate = false;  // gradients
  Krylov::Precondition preconditioner;
  Eigen::VectorXd inverse_diagonal, wall_residuals, wall_corrections;
  SolverReport report;
  Eigen::VectorXi units;  // powers of 2, one a column
  Eigen::MatrixXd rhs, solution, start, residuals, corrections;
};

LinearSolver::State::State(SparseMatrix&& matrix, const SolverOptions& options, SystemPoints system)
    : points(std::move(system)), options(options), n(static_cast<int>(matrix.rows())) {
  A.swap(matrix);  // Eigen 3.4 would copy
  check();
  if (!(this->options.memory > 0)) this->options.memory = 0.75 * machine_memory();
  scale = points.cloud.has_volumes() ? points.cloud.volumes() : Eigen::VectorXd::Ones(n);
  set_up();
}

std::string LinearSolver::State::row(int i) const {
  return has_points() ? "point " + std::to_string(points.cloud.number(i))
                      : "row " + std::to_string(i);
}

std::vector<int> LinearSolver::State::all_rows() const {
  std::vector<int> rows(n);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

void LinearSolver::State::check() const {
  if (A.rows() != A.cols() || !A.isCompressed())
    throw InvalidInput("the matrix must be square and compressed, not " + std::to_string(A.rows()) +
                       " x " + std::to_string(A.cols()));
  if (has_points() && points.cloud.size() != n)
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

void LinearSolver::State::check_matrix() const {
  for (int i = 0; i < n; ++i) {
    bool zero = true;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      if (!std::isfinite(a.value()))
        throw InvalidInput("the matrix is not finite in the row of " + row(i));
      zero = zero && a.value() == 0;
    }
    if (zero) throw InvalidInput("the matrix has only zeros in the row of " + row(i));
  }
  if (const FloatingRows rows = floating_rows(A); rows.count > 0)
    throw floating(rows.count, row(rows.first));
}

Elimination LinearSolver::State::elimination(const SparseMatrix& matrix) const {
  if (options.ordering != Ordering::Coordinates) return {options.ordering};
  if (!has_points()) return {Ordering::Amd};
  Stopwatch watch;
  Elimination result{Ordering::Coordinates, dissection(points.cloud.positions(), matrix)};
  result.seconds = watch.lap();
  return result;
}

/// Says what was chosen, and lets go of what was not.
void LinearSolver::State::choose(Method method, const std::string& description,
                                 const std::string& reason, const FactorReport& factor) {
  if (method != Method::Cholesky) cholesky.reset();
  if (method != Method::Lu) lu.reset();
  if (method != Method::Krylov) krylov.reset(), twin.reset(), walls.reset();
  report = {method, description, reason, n, factor};
}

void LinearSolver::State::set_up() {
  report = {};  // nothing to solve with, should any of this throw
  if (n == 0) return choose(Method::Krylov, "nothing", "there are no unknowns");
  check_matrix();
  symmetric = is_symmetric(A, scale);
  ratio = stiffness();
  try {
    switch (options.method) {
      case Method::Auto: return set_up_auto();
      case Method::Krylov: return set_up_krylov("as asked");
      case Method::Lu: return set_up_lu("as asked");
      case Method::Cholesky: break;
    }
    if (!symmetric) throw not_symmetric();
    if (!set_up_cholesky("as asked")) throw indefinite();
  } catch (const FactorTooLarge& error) {
    throw SolverError(std::string(name(options.method)) + ": " + error.what() +
                      "; krylov takes little");
  }
}

void LinearSolver::State::set_up_auto() {
  std::string reason = "the matrix is not symmetric";
  if (symmetric) {
    try {
      if (set_up_cholesky("the matrix is symmetric and positive definite")) return;
      reason = "the matrix is symmetric but not positive definite";
    } catch (const FactorTooLarge& error) {
      return set_up_krylov(std::string("the matrix is symmetric, but ") + error.what());
    }
  }
  reason += ", of " + std::to_string(n) + " unknowns";
  if (!std::isnan(ratio)) reason += ", with dt nu / dx^2 = " + rounded(ratio);
  const bool easy = n > always_lu && ratio <= mild;
  const bool small = n <= (points.cloud.dimension() == 3 ? most_lu_3d : most_lu);
  if (!easy && small && lu_fits(reason)) return;
  set_up_krylov(reason);
}

/// Sets up LU if the memory allows; else `reason` says why not.
bool LinearSolver::State::lu_fits(std::string& reason) {
  try {
    set_up_lu(reason);
    return true;
  } catch (const FactorTooLarge& error) {
    reason += std::string(", and for LU ") + error.what();
  } catch (const std::bad_alloc&) {
    reason += ", and memory ran out for LU";
  }
  lu.reset();
  return false;
}

/// Whether the matrix is positive definite.
bool LinearSolver::State::set_up_cholesky(const std::string& reason) {
  if (!cholesky) cholesky.emplace(A, scale, elimination(A), options.memory, options.threads);
  if (!cholesky->factorise(A)) {
    cholesky.reset();
    return false;
  }
  const FactorReport& factor = cholesky->report();
  choose(Method::Cholesky, "Cholesky (" + factor.description + ")", reason, factor);
  return true;
}

void LinearSolver::State::set_up_lu(const std::string& reason) {
  if (!lu) lu.emplace(A, elimination(A), options.memory, options.threads);
  lu->factorise(A);
  choose(Method::Lu, "LU (" + lu->report().description + ")", reason, lu->report());
}

void LinearSolver::State::set_up_krylov(const std::string& reason) {
  if (!krylov) krylov.emplace(n, options.threads);
  conjugate = symmetric && is_dominant(A);
  factorise_walls();
  const std::string name = conjugate ? "conjugate gradients" : "BiCGSTAB";
  if (ratio > stiff && points.cloud.dimension() < 3 && factorise_twin()) {
    preconditioner = [this](const double* r, double* z) {
      twin->solve(r, z, 1);
      correct_walls(r, z);
    };
    return choose(Method::Krylov,
                  name + " preconditioned by the factor (" + twin->report().description +
                      ") of a compact symmetric twin",
                  reason, twin->report());
  }
  inverse_diagonal = A.diagonal().unaryExpr([](double a) { return a != 0 ? 1 / a : 1; });
  preconditioner = [this](const double* r, double* z) {
    for (int i = 0; i < n; ++i) z[i] = inverse_diagonal[i] * r[i];
    correct_walls(r, z);
  };
  choose(Method::Krylov, name + " preconditioned by the diagonal", reason);
}

/// Neither the diagonal nor a twin knows anything of boundary conditions, and a preconditioner that
/// gets them wrong costs hundreds of iterations: their rows are factorised among themselves.
void LinearSolver::State::factorise_walls() {
  if (points.walls.empty()) return;
  std::vector<int> place(n, -1);
  for (std::size_t k = 0; k < points.walls.size(); ++k)
    place[points.walls[k]] = static_cast<int>(k);
  std::vector<Eigen::Triplet<double>> entries;
  for (const int i : points.walls)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (place[a.col()] >= 0) entries.emplace_back(place[i], place[a.col()], a.value());
  const auto count = static_cast<Eigen::Index>(points.walls.size());
  SparseMatrix among(count, count);
  among.setFromTriplets(entries.begin(), entries.end());
  try {
    if (!walls) walls.emplace(among, Elimination{}, options.memory, options.threads);
    walls->factorise(among);
  } catch (const std::exception&) {  // singular or too large: without, then
    walls.reset();
  }
  resize(wall_residuals, count);
  resize(wall_corrections, count);
}

/// Makes z meet the boundary conditions, given the residuals r.
void LinearSolver::State::correct_walls(const double* r, double* z) {
  if (!walls) return;
  for (std::size_t k = 0; k < points.walls.size(); ++k) {
    const int i = points.walls[k];
    wall_residuals[k] = r[i] - row_product(A, i, z);
  }
  walls->solve(wall_residuals.data(), wall_corrections.data(), 1);
  for (std::size_t k = 0; k < points.walls.size(); ++k) z[points.walls[k]] += wall_corrections[k];
}

/// Whether the twin fits the memory and is positive definite.
bool LinearSolver::State::factorise_twin() {
  const std::vector<int> rows = all_rows();
  SparseMatrix matrix;
  compact_twin(A, points.cloud, rows,
               twin_scales(A, points.cloud, rows, points.walls, options.threads), options.threads,
               matrix);
  try {
    if (!twin) twin.emplace(matrix, scale, elimination(matrix), options.memory, options.threads);
    return twin->factorise(matrix);
  } catch (const FactorTooLarge&) {
    return false;
  }
}

/// dt nu / dx^2 at the median row, infinity in a steady problem; NaN if there are no volumes to tell.
double LinearSolver::State::stiffness() const {
  if (!points.cloud.has_volumes()) return std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd ratios = row_diffusivities(A, points.cloud, all_rows(), options.threads);
  for (int i = 0; i < n; ++i) {
    double sum = 0, size = 0;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      sum += a.value();
      size += std::abs(a.value());
    }
    ratios[i] = sum > 0 && !vanishes(sum, size)
                    ? ratios[i] / (sum * std::pow(scale[i], 2.0 / points.cloud.dimension()))
                    : std::numeric_limits<double>::infinity();
  }
  return median(std::move(ratios));
}

// Solving

/// Whether |b - A x| is below the tolerance, or as small as rounding lets it be. Its size is left in
/// `residual`, relative to |b|, unless that is 0.
bool LinearSolver::State::is_solution(int column, double& residual) {
  const double* const b = rhs.col(column).data();
  const double* const x = solution.col(column).data();
  const double size = rhs.col(column).norm();
  const double norm = gradpsi::residual(A, b, x, residuals.col(column).data(), options.threads);
  residual = size > 0 ? norm / size : norm;
  if (!std::isfinite(norm)) return false;
  if (norm <= options.tolerance * size) return true;
  if (norm > 1e-4 * size) return false;  // no rounding error of a matrix worth solving with
  double squared = 0;
  for (int i = 0; i < n; ++i) {
    double terms = std::abs(b[i]);
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) terms += std::abs(a.value() * x[a.col()]);
    squared += terms * terms;
  }
  return norm <= 8 * std::numeric_limits<double>::epsilon() * std::sqrt(squared);
}

/// Solves by the factor, then refines up to twice.
void LinearSolver::State::solve_directly(SolveReport& result) {
  const int columns = static_cast<int>(rhs.cols());
  const auto solve = [&](const Eigen::MatrixXd& from, Eigen::MatrixXd& to) {
    report.method == Method::Cholesky ? cholesky->solve(from.data(), to.data(), columns)
                                      : lu->solve(from.data(), to.data(), columns);
  };
  solve(rhs, solution);
  for (;; ++result.iterations) {
    bool good = true;
    result.residual = 0;
    for (int c = 0; c < columns; ++c) {
      double residual;
      good = is_solution(c, residual) && good;
      if (!(residual <= result.residual)) result.residual = residual;  // NaN, too
    }
    if (good) return;
    if (result.iterations == 2) throw unsolved(report, result);
    solve(residuals, corrections);
    solution += corrections;
  }
}

/// Iterates on each column, again from the true residual as long as that halves it.
void LinearSolver::State::iterate(SolveReport& result, int limit) {
  double worst = 0;
  for (int c = 0; c < rhs.cols(); ++c) {
    const double* const b = rhs.col(c).data();
    double* const x = solution.col(c).data();
    const double target = options.tolerance * rhs.col(c).norm();
    if (target == 0) solution.col(c).setZero();
    int left = limit;
    double residual, before = std::numeric_limits<double>::infinity();
    while (!is_solution(c, residual)) {
      result.residual = residual;
      if (left == 0 || !(residual < before / 2)) throw unsolved(report, result);
      before = residual;
      const int done =
          conjugate ? krylov->conjugate_gradients(A, scale, preconditioner, b, x, target, left)
                    : krylov->bicgstab(A, preconditioner, b, x, target, left);
      result.iterations += done;
      left -= done;
    }
    worst = std::max(worst, residual);
  }
  result.residual = worst;
}

/// Iterates; where the method was ours to choose and does not converge in 1,000 iterations, LU takes
/// over from then on if the memory allows.
void LinearSolver::State::iterate_or_factorise(SolveReport& result) {
  if (options.method != Method::Auto) return iterate(result, options.max_iterations);
  resize(start, solution.rows(), solution.cols());
  start = solution;
  try {
    return iterate(result, std::min(options.max_iterations, 1'000));
  } catch (const SolverError&) {
    solution = start;
    result = {};
  }
  std::string reason = report.reason + ", and iterations did not converge";
  lu_fits(reason) ? solve_directly(result) : iterate(result, options.max_iterations);
}

LinearSolver::LinearSolver(SparseMatrix matrix, SolverOptions options, SystemPoints points)
    : state_(std::make_unique<State>(std::move(matrix), options, std::move(points))) {}

LinearSolver::LinearSolver(LinearSolver&&) noexcept = default;
LinearSolver& LinearSolver::operator=(LinearSolver&&) noexcept = default;
LinearSolver::~LinearSolver() = default;

void LinearSolver::refactor(SparseMatrix matrix) {
  State& s = *state_;
  const auto same = [](const int* a, const int* b, Eigen::Index count) {
    return std::equal(a, a + count, b);
  };
  if (matrix.rows() != s.n || matrix.cols() != s.n || !matrix.isCompressed() ||
      matrix.nonZeros() != s.A.nonZeros() ||
      !same(matrix.outerIndexPtr(), s.A.outerIndexPtr(), s.n + 1) ||
      !same(matrix.innerIndexPtr(), s.A.innerIndexPtr(), matrix.nonZeros()))
    throw InvalidInput("refactor needs a matrix of the pattern that was analysed");
  s.A.swap(matrix);
  s.set_up();
}

SolveReport LinearSolver::solve(const Eigen::Ref<const Eigen::MatrixXd>& b,
                                Eigen::Ref<Eigen::MatrixXd> x) {
  State& s = *state_;
  Stopwatch watch;
  if (b.rows() != s.n || x.rows() != s.n || b.cols() != x.cols())
    throw InvalidInput("b is " + std::to_string(b.rows()) + " x " + std::to_string(b.cols()) +
                       " and x " + std::to_string(x.rows()) + " x " + std::to_string(x.cols()) +
                       " for a matrix of " + std::to_string(s.n) + " rows");
  for (Eigen::Index c = 0; c < b.cols(); ++c)
    for (int i = 0; i < s.n; ++i)
      if (!std::isfinite(b(i, c)) || !std::isfinite(x(i, c)))
        throw InvalidInput("the right-hand side or the start is not finite at " + s.row(i));
  SolveReport result;
  if (s.report.method == Method::Auto)
    throw SolverError("there is no factor: the latest refactor() failed");
  if (s.n == 0 || b.cols() == 0) return result;
  // In units in which b is about 1 its square neither overflows nor vanishes.
  for (Eigen::MatrixXd* matrix : {&s.rhs, &s.solution, &s.residuals, &s.corrections})
    resize(*matrix, b.rows(), b.cols());
  s.rhs = b;
  s.solution = x;
  resize(s.units, b.cols());
  for (Eigen::Index c = 0; c < b.cols(); ++c) {
    const double largest = b.col(c).cwiseAbs().maxCoeff();
    s.units[c] = largest > 0 ? std::ilogb(largest) : 0;
    for (int i = 0; i < s.n; ++i) {
      s.rhs(i, c) = std::ldexp(b(i, c), -s.units[c]);
      s.solution(i, c) = std::ldexp(x(i, c), -s.units[c]);
    }
  }
  if (!s.solution.allFinite()) s.solution.setZero();  // a start that far off is none
  s.report.method == Method::Krylov ? s.iterate_or_factorise(result) : s.solve_directly(result);
  for (Eigen::Index c = 0; c < b.cols(); ++c)
    for (int i = 0; i < s.n; ++i) x(i, c) = std::ldexp(s.solution(i, c), s.units[c]);
  result.seconds = watch.lap();
  return result;
}

const SolverReport& LinearSolver::report() const { return state_->report; }
const SparseMatrix& LinearSolver::matrix() const { return state_->A; }

}  // namespace gradpsi
