#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "base/sets.hpp"
#include "diffusion/conditions.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "gradpsi/system.hpp"
#include "matrix/checks.hpp"
#include "multigrid/for_petsc.hpp"
#include "petsc/collective.hpp"
#include "petsc/matrix.hpp"
#include "petsc/options.hpp"
#include "petsc/solver.hpp"
#include "petsc/vectors.hpp"
#include "solve/errors.hpp"
#include "solve/for_petsc.hpp"

namespace gradpsi::petsc {
namespace {

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
  DenseMatrix marks = DenseMatrix::Zero(std::ssize(mine.own()), 2);  // and values
  for (std::size_t k = 0; k < own.points.size(); ++k) {
    marks(place[own.points[k]], 0) = 1;
    if (prescribed) marks(place[own.points[k]], 1) = own.values[k];
  }
  const DenseMatrix all = mine.spread(marks);
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
DenseVector column_values(const Subdomain& mine, const DiffusionSystem& system,
                          const VectorView& of_rows) {
  const std::vector<int> place = own_places(mine);
  DenseVector own = DenseVector::Zero(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < of_rows.size(); ++k) own[place[system.rows()[k]]] = of_rows[k];
  return mine.spread(own)(system.columns(), 0);
}

/// Throws if constants on a connected set of unknowns are in the null space. Sets that reach over several
/// processes are known by their lowest point, which spreads from process to process, along entries: a set
/// that nothing flows into is one, whatever it flows into.
void check_floating(const Subdomain& mine, const DiffusionSystem& system) {
  const MPI_Comm comm = mine.partition().comm();
  const std::vector<char> floats = vanishing_rows(system.matrix());
  if (!anywhere(comm, std::ranges::count(floats, 1) > 0)) return;
  const auto& rows = system.rows();
  const auto& columns = system.columns();
  Sets connected(mine.cloud().size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (SparseMatrix::InnerIterator a(system.matrix(), static_cast<int>(k)); a; ++a)
      if (a.value() != 0) connected.merge(rows[k], columns[a.col()]);
  std::vector<PetscInt> lowest(mine.cloud().size()), sinks(mine.cloud().size());
  for (int i = 0; i < mine.cloud().size(); ++i)
    lowest[i] = static_cast<PetscInt>(mine.cloud().number(connected.of(i)));
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (!floats[k]) sinks[connected.of(rows[k])] = true;
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
Cloud column_points(const Cloud& cloud, const VectorView& volumes,
                    const std::vector<int>& columns) {
  return Cloud(cloud.positions()(columns, Eigen::all),
               {.volumes = volumes(columns), .box = cloud.box()});
}

/// Of the whole system, with its matrix in PETSc's form.
Traits traits_of(const Subdomain& mine, const DiffusionSystem& system, const Cloud& points,
                 const Numbering& numbers, Mat A, const SolverOptions& options) {
  const MPI_Comm comm = mine.partition().comm();
  const RowTraits rows = row_traits(system.matrix(), points, numbers.diagonal, options.threads);
  return {.unknowns = numbers.size,
          .dimension = points.dimension(),
          .symmetric = is_symmetric(A, system.points().cloud.volumes()),
          .dominant = !anywhere(comm, !rows.dominant),
          .walls = anywhere(comm, !system.points().walls.empty()),
          .spread = true,
          .stiffness = median(comm, rows.stiffness),
          .solves = expected_solves(options)};
}

/// The compact twin of the system's matrix, see twin.hpp.
Handle<Mat> twin_of(const Subdomain& mine, const DiffusionSystem& system, const Cloud& points,
                    const Numbering& numbers, int threads) {
  const MPI_Comm comm = mine.partition().comm();
  const SparseMatrix& A = system.matrix();
  const DenseVector scales = column_values(
      mine, system, twin_scales(A, points, numbers.diagonal, system.points().walls, threads));
  SparseMatrix rows;
  together(comm, [&] { compact_twin(A, points, numbers.diagonal, scales, threads, rows); });
  return make_matrix(comm, rows, numbers.columns);
}

/// Rows whose diagonal is weak, those that share an entry with them and, if there are any, walls.
/// @throws NoHierarchy  in all processes: if that is more than can be factorised
std::vector<int> weak_rows(const Subdomain& mine, const DiffusionSystem& system,
                           const Smoother& rows, std::int64_t unknowns) {
  const MPI_Comm comm = mine.partition().comm();
  if (!anywhere(comm, std::ranges::count(rows.is_weak, 1) > 0)) return {};
  const SparseMatrix& A = system.matrix();
  DenseVector marks(A.rows());
  for (Eigen::Index k = 0; k < A.rows(); ++k) marks[k] = rows.is_weak[k];
  const DenseVector of_columns = column_values(mine, system, marks);
  for (int k = 0; k < A.rows(); ++k)
    for (SparseMatrix::InnerIterator a(A, k); a; ++a)
      if (of_columns[a.col()] != 0) marks[k] = 1;
  marks(system.points().walls).setOnes();
  std::vector<int> result;
  for (int k = 0; k < A.rows(); ++k)
    if (marks[k] != 0) result.push_back(k);
  if (sum_of(comm, std::int64_t{std::ssize(result)}) > most_weak_rows(unknowns))
    throw NoHierarchy("too many rows have weak diagonals");
  return result;
}

/// Coarser levels that each process makes and solves by itself are worth it while its share of the finest one is not
/// too small beside them: by the times of one and two processes in benchmarks/README.md, carried on.
void check_worth(MPI_Comm comm, int dimension, std::int64_t unknowns) {
  constexpr std::int64_t most_unknowns = 100'000'000;  // a process holds some 60 bytes of each
  if (processes(comm) > (dimension == 3 ? 64 : 8) || unknowns > most_unknowns)
    throw NoHierarchy("there are too many processes or unknowns");
}

/// The levels of multigrid on the points.
/// @throws NoHierarchy  in all processes: where there can be none
RowLevels levels_of(const Subdomain& mine, const DiffusionSystem& system, const Cloud& points,
                    const Numbering& numbers, bool symmetric, int threads) {
  const MPI_Comm comm = mine.partition().comm();
  check_worth(comm, points.dimension(), numbers.size);
  const SparseMatrix& A = system.matrix();
  const SystemPoints& rows = system.points();
  Smoother own = smoother(A, numbers.diagonal, threads);
  std::vector<int> weak;
  if (!symmetric) weak = weak_rows(mine, system, own, numbers.size);
  const OtherRows others{
      .median = [&](const DenseVector& of_rows) { return median(comm, of_rows); },
      .columns = [&](const DenseVector& of_rows) { return column_values(mine, system, of_rows); },
      .anywhere = [&](bool here) { return petsc::anywhere(comm, here); }};
  std::vector<char> left_out(A.rows(), false);
  for (const int k : rows.walls) left_out[k] = true;
  Medium medium =
      medium_of(A, rows.cloud.volumes(), row_diffusivities(A, points, numbers.diagonal, threads),
                left_out, others, threads);
  return row_levels(
      comm, {rows.cloud, std::move(medium), std::move(own), rows.walls, std::move(weak)}, threads);
}

void check_arguments(const Subdomain& mine, const Operator& laplacian,
                     const DiffusionOptions& options, bool sourced) {
  check_options(options.solver);
  if (laplacian.points != mine.own())
    throw InvalidInput("the Laplacian does not have the rows of all own points, in order");
  if (laplacian.volumes.size() != mine.cloud().size())
    throw InvalidInput("the Laplacian has " + std::to_string(laplacian.volumes.size()) +
                       " volumes for " + std::to_string(mine.cloud().size()) + " points");
  if (sourced && options.source.size() != std::ssize(mine.own()))
    throw InvalidInput("the source has " + std::to_string(options.source.size()) + " entries for " +
                       std::to_string(mine.own().size()) + " points");
}

/// By the theta method, or half as long by backward Euler.
enum class Step { Whole, Half };

}  // namespace

struct ImplicitDiffusion::State {
  State(const Subdomain& mine, Operator&& laplacian, const BoundaryConditions& conditions,
        const DiffusionOptions& options);
  void set_up(const Cloud& points, const Numbering& numbers, const SolverOptions& options);
  SolveReport advance(Eigen::Ref<Eigen::VectorXd> u, Step kind);

  const Subdomain& mine;
  double theta;
  std::optional<DiffusionSystem> system;
  std::optional<Solver> solver;
  SolverReport nothing;  // to solve
  DenseVector product, rhs, solution;
};

ImplicitDiffusion::State::State(const Subdomain& mine, Operator&& laplacian,
                                const BoundaryConditions& conditions,
                                const DiffusionOptions& options)
    : mine(mine), theta(options.theta) {
  const MPI_Comm comm = mine.partition().comm();
  const bool sourced = anywhere(comm, options.source.size() > 0);
  together(comm, [&] { check_arguments(mine, laplacian, options, sourced); });
  BoundaryConditions all = conditions;
  all.fixed = with_halo(mine, conditions.fixed);
  DiffusionOptions equation = options;
  if (sourced) equation.source = mine.spread(options.source);
  together(comm, [&] { system.emplace(mine.cloud(), laplacian, all, equation); });
  const Cloud points = column_points(mine.cloud(), laplacian.volumes, system->columns());
  laplacian = {};
  const Numbering numbers = numbering(mine, *system);
  if (numbers.size == 0) {
    nothing = {Method::Krylov, "nothing", "there are no unknowns", 0, {}};
    return;
  }
  together(comm, [&] {
    check_rows(system->matrix(), [&](int k) {
      return "point " + std::to_string(mine.cloud().number(system->rows()[k]));
    });
  });
  check_floating(mine, *system);
  SolverOptions solver_options = options.solver;
  if (std::isinf(options.time_step) && solver_options.solves == 0) solver_options.solves = 1;
  set_up(points, numbers, solver_options);
  for (DenseVector* v : {&product, &rhs, &solution}) v->resize(std::ssize(system->rows()));
}

/// Hands the system over to a solver.
void ImplicitDiffusion::State::set_up(const Cloud& points, const Numbering& numbers,
                                      const SolverOptions& options) {
  const MPI_Comm comm = mine.partition().comm();
  SpreadSystem spread{.A = make_matrix(comm, system->matrix(), numbers.columns),
                      .volumes = system->points().cloud.volumes(),
                      .walls = system->points().walls,
                      .traits = {}};
  spread.traits = traits_of(mine, *system, points, numbers, spread.A.get(), options);
  Choice choice = choose(spread.traits, options.method);
  if (iterates(choice.method) && choice.preconditioner == Preconditioner::Points &&
      !has_option("-pc_type")) {
    try {
      spread.levels = levels_of(mine, *system, points, numbers, choice.conjugate, options.threads);
    } catch (const NoHierarchy& why) {
      choice.preconditioner = by_entries(spread.traits);
      choice.reason += std::string(", and for multigrid on the points ") + why.what();
    }
    if (choice.preconditioner == Preconditioner::TwinMultigrid)
      spread.twin = twin_of(mine, *system, points, numbers, options.threads);
  }
  system->take_matrix();
  system->take_points();
  solver.emplace(comm, std::move(spread), choice, options);
}

ImplicitDiffusion::ImplicitDiffusion(const Subdomain& mine, Operator laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : state_(std::make_unique<State>(mine, std::move(laplacian), conditions, options)) {}
ImplicitDiffusion::ImplicitDiffusion(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion::~ImplicitDiffusion() = default;

SolveReport ImplicitDiffusion::State::advance(Eigen::Ref<Eigen::VectorXd> u, Step kind) {
  together(mine.partition().comm(), [&] {
    if (u.size() != std::ssize(mine.own()))
      throw InvalidInput("the field has " + std::to_string(u.size()) + " values for " +
                         std::to_string(mine.own().size()) + " points");
    for (Eigen::Index k = 0; k < u.size(); ++k)
      if (!std::isfinite(u[k]))
        throw InvalidInput("the field is not finite at point " +
                           std::to_string(mine.cloud().number(mine.own()[k])));
  });
  DenseVector all = mine.spread(u);
  const auto span = [](DenseVector& v) {
    return std::span(v.data(), static_cast<std::size_t>(v.size()));
  };
  SolveReport report;
  if (solver) {
    const std::vector<int>& rows = system->rows();
    solution = all(rows);
    if (kind == Step::Half) {
      system->damped_right_hand_side(span(all), span(rhs));
    } else {
      if (system->needs_product()) solver->multiply(solution, product);
      system->right_hand_side(span(all), span(product), span(rhs));
    }
    report = solver->solve(rhs, solution);
    all(rows) = solution;
  }
  system->set_fixed(span(all));
  u = all(mine.own());
  return report;
}

SolveReport ImplicitDiffusion::step(Eigen::Ref<Eigen::VectorXd> u) {
  return state_->advance(u, Step::Whole);
}

SolveReport ImplicitDiffusion::damped_step(Eigen::Ref<Eigen::VectorXd> u) {
  check_damping(state_->theta);
  DenseVector next = u;
  const SolveReport first = state_->advance(next, Step::Half);
  const SolveReport second = state_->advance(next, Step::Half);
  u = next;
  return both(first, second);
}

const SolverReport& ImplicitDiffusion::solver() const {
  return state_->solver ? state_->solver->report() : state_->nothing;
}

}  // namespace gradpsi::petsc
