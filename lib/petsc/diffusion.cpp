#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "base/sets.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "matrix/checks.hpp"
#include "petsc/collective.hpp"
#include "petsc/matrix.hpp"
#include "petsc/solver.hpp"
#include "solve/errors.hpp"
#include "solve/twin.hpp"

namespace gradpsi::petsc {
namespace {

/// Whether multigrid is worth its set-up, by the iterations that the diagonal would take: they grow with a
/// step's reach, sqrt(dt nu), until that is the whole domain. Measured in benchmarks/README.md.
bool needs_multigrid(double ratio, double unknowns, int dimension) {
  const double width = std::pow(unknowns, 1.0 / dimension);
  const double iterations = std::min(10 * std::sqrt(ratio), 1.3 * width);
  return iterations > 60;
}

/// The place of a subdomain's points among own ones; -1: halo.
std::vector<int> own_places(const Subdomain& mine) {
  std::vector<int> place(mine.cloud().size(), -1);
  for (std::size_t k = 0; k < mine.own().size(); ++k) place[mine.own()[k]] = static_cast<int>(k);
  return place;
}

/// The halo's fixed points added to the own ones.
FixedValues with_halo(const Subdomain& mine, const FixedValues& own) {
  const std::vector<int> place = own_places(mine);
  const bool prescribed = anywhere(mine.partition().comm(), own.values.size() > 0);
  together(mine.partition().comm(), [&] {
    if (prescribed && own.values.size() != std::ssize(own.points))
      throw InvalidInput("fixed.values has " + std::to_string(own.values.size()) + " entries for " +
                         std::to_string(own.points.size()) + " points");
    for (const int i : own.points)
      if (i < 0 || i >= mine.cloud().size() || place[i] < 0)
        throw InvalidInput("there is no own point " + std::to_string(i) + " to have a condition");
  });
  Eigen::MatrixXd marks = Eigen::MatrixXd::Zero(std::ssize(mine.own()), 2);  // and values
  for (std::size_t k = 0; k < own.points.size(); ++k) {
    marks(place[own.points[k]], 0) = 1;
    if (prescribed) marks(place[own.points[k]], 1) = own.values[k];
  }
  const Eigen::MatrixXd all = mine.spread(marks);
  FixedValues result{own.points};
  for (int i = 0; i < mine.cloud().size(); ++i)
    if (place[i] < 0 && all(i, 0) != 0) result.points.push_back(i);
  if (prescribed) result.values = all(result.points, 1);
  return result;
}

/// Where this process's rows are in the system of all.
struct Numbering {
  std::vector<PetscInt> columns;  // number of each of the system's columns
  std::vector<int> diagonal;      // of each row, among the columns
  std::int64_t size;              // of the whole system
};

Numbering numbering(const Subdomain& mine, const DiffusionSystem& system) {
  const MPI_Comm comm = mine.partition().comm();
  const std::vector<int> place = own_places(mine);
  const auto count = static_cast<std::int64_t>(system.rows().size());
  std::int64_t next = sum_before(comm, count);
  std::vector<PetscInt> numbers(mine.own().size(), -1);
  for (const int i : system.rows()) numbers[place[i]] = static_cast<PetscInt>(next++);
  const std::vector<PetscInt> all = mine.spread(numbers);
  Numbering result{{}, std::vector<int>(system.rows().size()), sum_of(comm, count)};
  std::vector<int> column(mine.cloud().size(), -1);
  for (const int i : system.columns()) {
    column[i] = static_cast<int>(result.columns.size());
    result.columns.push_back(all[i]);
  }
  for (std::size_t k = 0; k < system.rows().size(); ++k)
    result.diagonal[k] = column[system.rows()[k]];
  return result;
}

/// What belongs to rows, for all columns of the system.
Eigen::VectorXd column_values(const Subdomain& mine, const DiffusionSystem& system,
                              const Eigen::VectorXd& of_rows) {
  const std::vector<int> place = own_places(mine);
  Eigen::VectorXd own = Eigen::VectorXd::Zero(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < of_rows.size(); ++k) own[place[system.rows()[k]]] = of_rows[k];
  return mine.spread(own)(system.columns(), 0);
}

struct RowSum {
  double sum = 0, size = 0;
};

std::vector<RowSum> row_sums(const SparseMatrix& A) {
  std::vector<RowSum> result(A.rows());
  for (int k = 0; k < A.rows(); ++k)
    for (SparseMatrix::InnerIterator a(A, k); a; ++a) {
      result[k].sum += a.value();
      result[k].size += std::abs(a.value());
    }
  return result;
}

/// Throws if a row is not finite, or has only zeros.
void check_rows(const Cloud& cloud, const DiffusionSystem& system,
                const std::vector<RowSum>& sums) {
  const auto point = [&](std::size_t k) {
    return "point " + std::to_string(cloud.number(system.rows()[k]));
  };
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (!std::isfinite(sums[k].size))
      throw InvalidInput("the matrix is not finite in the row of " + point(k));
    if (sums[k].size == 0)
      throw InvalidInput("the matrix has only zeros in the row of " + point(k));
  }
}

/// Throws if constants on a connected set of unknowns are in the null space. Sets that reach over several
/// processes are known by their lowest point, which spreads from process to process, along entries: a set
/// that nothing flows into is one, whatever it flows into.
void check_floating(const Subdomain& mine, const DiffusionSystem& system,
                    const std::vector<RowSum>& sums) {
  const MPI_Comm comm = mine.partition().comm();
  const auto floats = [](const RowSum& row) { return vanishes(row.sum, row.size); };
  if (!anywhere(comm, std::ranges::any_of(sums, floats))) return;
  const auto& rows = system.rows();
  const auto& columns = system.columns();
  Sets connected(mine.cloud().size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (SparseMatrix::InnerIterator a(system.matrix, static_cast<int>(k)); a; ++a)
      if (a.value() != 0) connected.merge(rows[k], columns[a.col()]);
  std::vector<PetscInt> lowest(mine.cloud().size()), sinks(mine.cloud().size());
  for (int i = 0; i < mine.cloud().size(); ++i)
    lowest[i] = static_cast<PetscInt>(mine.cloud().number(connected.of(i)));
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (!floats(sums[k])) sinks[connected.of(rows[k])] = true;
  // Each round, sets hear from the halo what the others' parts of them are called.
  std::vector<PetscInt> own_lowest(mine.own().size()), own_sinks(mine.own().size());
  for (bool changed = true; changed;) {
    for (std::size_t k = 0; k < mine.own().size(); ++k) {
      own_lowest[k] = lowest[connected.of(mine.own()[k])];
      own_sinks[k] = sinks[connected.of(mine.own()[k])];
    }
    const auto heard_lowest = mine.spread(own_lowest), heard_sinks = mine.spread(own_sinks);
    changed = false;
    for (const int i : columns) {
      const int set = connected.of(i);
      if (heard_lowest[i] >= lowest[set] && heard_sinks[i] <= sinks[set]) continue;
      lowest[set] = std::min(lowest[set], heard_lowest[i]);
      sinks[set] = std::max(sinks[set], heard_sinks[i]);
      changed = true;
    }
    changed = anywhere(comm, changed);
  }
  std::int64_t first = mine.partition().size();
  for (const int i : rows)
    if (!sinks[connected.of(i)]) first = std::min<std::int64_t>(first, lowest[connected.of(i)]);
  first = least_of(comm, first);
  if (first == mine.partition().size()) return;
  const std::int64_t count = sum_of(comm, std::int64_t{std::ranges::count_if(rows, [&](int i) {
                                      return lowest[connected.of(i)] == first;
                                    })});
  throw floating(count, "point " + std::to_string(first));
}

/// The points of the system's columns, with their volumes.
Cloud column_points(const Cloud& cloud, const Eigen::VectorXd& volumes,
                    const std::vector<int>& columns) {
  return Cloud(cloud.positions()(columns, Eigen::all),
               {.volumes = volumes(columns), .box = cloud.box()});
}

/// dt nu / dx^2 at the median row; infinity counts where a row sums to zero.
double stiffness(MPI_Comm comm, const SparseMatrix& A, const Cloud& points,
                 const std::vector<int>& diagonal, const std::vector<RowSum>& sums, int threads) {
  Eigen::VectorXd ratios = row_diffusivities(A, points, diagonal, threads);
  for (Eigen::Index k = 0; k < ratios.size(); ++k)
    ratios[k] = sums[k].sum > 0 && !vanishes(sums[k].sum, sums[k].size)
                    ? ratios[k] / (sums[k].sum * std::pow(points.volumes()[diagonal[k]],
                                                          2.0 / points.dimension()))
                    : std::numeric_limits<double>::infinity();
  return median(comm, ratios);
}

/// Whether every diagonal entry is at least the sum of the magnitudes of the others in its row.
bool is_dominant(const SparseMatrix& A, const std::vector<int>& diagonal,
                 const std::vector<RowSum>& sums) {
  for (int k = 0; k < A.rows(); ++k) {
    const double d = A.coeff(k, diagonal[k]);
    if (!(2 * d >= (1 - 1e-12) * sums[k].size)) return false;
  }
  return true;
}

/// The compact twin of the system's matrix, see twin.hpp.
Handle<Mat> twin_of(const Subdomain& mine, const DiffusionSystem& system, const Cloud& points,
                    const Numbering& numbers, int threads) {
  const MPI_Comm comm = mine.partition().comm();
  const SparseMatrix& A = system.matrix;
  const Eigen::VectorXd scales = column_values(
      mine, system, twin_scales(A, points, numbers.diagonal, system.points.walls, threads));
  SparseMatrix rows;
  together(comm, [&] { compact_twin(A, points, numbers.diagonal, scales, threads, rows); });
  return make_matrix(comm, rows, numbers.columns);
}

}  // namespace

struct ImplicitDiffusion::State {
  State(const Subdomain& mine, Operator&& laplacian, const BoundaryConditions& conditions,
        const DiffusionOptions& options);

  const Subdomain& mine;
  std::optional<DiffusionSystem> system;
  std::optional<Solver> solver;
  SolverReport nothing;  // to solve
  Eigen::VectorXd product, rhs, solution;
};

ImplicitDiffusion::State::State(const Subdomain& mine, Operator&& laplacian,
                                const BoundaryConditions& conditions,
                                const DiffusionOptions& options)
    : mine(mine) {
  const MPI_Comm comm = mine.partition().comm();
  const bool sourced = anywhere(comm, options.source.size() > 0);
  together(comm, [&] {
    check_options(options.solver);
    if (laplacian.points != mine.own())
      throw InvalidInput("the Laplacian does not have the rows of all own points, in order");
    if (laplacian.volumes.size() != mine.cloud().size())
      throw InvalidInput("the Laplacian has " + std::to_string(laplacian.volumes.size()) +
                         " volumes for " + std::to_string(mine.cloud().size()) + " points");
    if (sourced && options.source.size() != std::ssize(mine.own()))
      throw InvalidInput("the source has " + std::to_string(options.source.size()) +
                         " entries for " + std::to_string(mine.own().size()) + " points");
  });
  BoundaryConditions all = conditions;
  all.fixed = with_halo(mine, conditions.fixed);
  DiffusionOptions equation = options;
  if (sourced) equation.source = mine.spread(options.source);
  together(comm, [&] { system.emplace(mine.cloud(), laplacian, all, equation); });
  const Cloud points = column_points(mine.cloud(), laplacian.volumes, system->columns());
  laplacian = {};

  const Numbering numbers = numbering(mine, *system);
  const auto& [columns, diagonal, unknowns] = numbers;
  if (unknowns == 0) {
    nothing = {Method::Krylov, "nothing", "there are no unknowns", 0, {}};
    return;
  }
  const int threads = options.solver.threads;
  const std::vector<int>& walls = system->points.walls;
  const std::vector<RowSum> sums = row_sums(system->matrix);
  together(comm, [&] { check_rows(mine.cloud(), *system, sums); });
  check_floating(mine, *system, sums);
  Traits traits{.dominant = !anywhere(comm, !is_dominant(system->matrix, diagonal, sums)),
                .multigrid = false,
                .ratio = stiffness(comm, system->matrix, points, diagonal, sums, threads),
                .dimension = points.dimension()};
  traits.multigrid = needs_multigrid(traits.ratio, static_cast<double>(unknowns), traits.dimension);
  // The twin is worth its making where A has long rows or rows that multigrid cannot use.
  const Method method = options.solver.method;
  const bool iterates = method == Method::Auto || method == Method::Krylov;
  const bool wanted = traits.dimension == 3 || anywhere(comm, !walls.empty());
  Handle<Mat> twin;
  if (traits.multigrid && iterates && wanted && !has_option("-pc_type"))
    twin = twin_of(mine, *system, points, numbers, threads);
  Handle<Mat> A = make_matrix(comm, system->matrix, columns);
  SparseMatrix().swap(system->matrix);  // Eigen 3.4 would keep the memory of what is assigned to
  solver.emplace(comm, std::move(A), std::move(twin), system->points.cloud.volumes(), walls, traits,
                 options.solver);
  system->points = {};
  for (Eigen::VectorXd* v : {&product, &rhs, &solution}) v->resize(std::ssize(sums));
}

ImplicitDiffusion::ImplicitDiffusion(const Subdomain& mine, Operator laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : state_(std::make_unique<State>(mine, std::move(laplacian), conditions, options)) {}
ImplicitDiffusion::ImplicitDiffusion(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion::~ImplicitDiffusion() = default;

SolveReport ImplicitDiffusion::step(Eigen::VectorXd& u) {
  State& s = *state_;
  const Subdomain& mine = s.mine;
  together(mine.partition().comm(), [&] {
    if (u.size() != std::ssize(mine.own()))
      throw InvalidInput("the field has " + std::to_string(u.size()) + " values for " +
                         std::to_string(mine.own().size()) + " points");
    for (Eigen::Index k = 0; k < u.size(); ++k)
      if (!std::isfinite(u[k]))
        throw InvalidInput("the field is not finite at point " +
                           std::to_string(mine.cloud().number(mine.own()[k])));
  });
  Eigen::VectorXd all = mine.spread(u);
  SolveReport report;
  if (s.solver) {
    const std::vector<int>& rows = s.system->rows();
    s.solution = all(rows);
    if (s.system->needs_product()) s.solver->multiply(s.solution, s.product);
    s.system->right_hand_side(all.data(), s.product.data(), s.rhs.data());
    report = s.solver->solve(s.rhs, s.solution);
    all(rows) = s.solution;
  }
  s.system->set_fixed(all.data());
  u = all(mine.own());
  return report;
}

const SolverReport& ImplicitDiffusion::solver() const {
  return state_->solver ? state_->solver->report() : state_->nothing;
}

}  // namespace gradpsi::petsc
