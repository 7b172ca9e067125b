// Linear systems, and time steps that need them.

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

/// A solver, used by one thread at a time, and how its latest solve went.
template <class Solver>
struct Shared {
  Solver solver;
  std::mutex turn = {};
  std::optional<SolveReport> latest = {};

  /// Calls f(solver) while other Python threads run.
  template <class F>
  auto use(F&& f) {
    const py::gil_scoped_release release;  // first, or who waits for his turn would keep the GIL
    const std::lock_guard alone(turn);
    return f(solver);
  }
};
using Linear = Shared<LinearSolver>;
using Diffusion = Shared<ImplicitDiffusion>;
using Pressure = Shared<Poisson>;

constexpr std::pair<std::string_view, Ordering> orderings[] = {
    {"coordinates", Ordering::Coordinates}, {"amd", Ordering::Amd}, {"metis", Ordering::Metis}};

SolverOptions solver_options(const std::string& its_method, double tolerance, int max_iterations,
                             const std::string& ordering, double memory, int threads, int solves,
                             std::optional<double> mean) {
  return {.method = method(its_method),
          .tolerance = tolerance,
          .max_iterations = max_iterations,
          .ordering = choice("ordering", ordering, orderings),
          .memory = memory,
          .threads = threads,
          .solves = solves,
          .mean = mean};
}

std::string_view ordering_name(const SolverOptions& options) {
  return std::ranges::find(orderings, options.ordering,
                           &std::pair<std::string_view, Ordering>::second)
      ->first;
}

std::unique_ptr<Linear> linear_solver(const SparseLike& matrix, const SolverOptions& options,
                                      const Cloud* cloud, const ArrayLike& walls) {
  SparseMatrix A = sparse(matrix, "matrix");
  SystemPoints system{.walls = points(walls, "walls", static_cast<int>(A.rows()))};
  if (cloud) system.cloud = *cloud;
  return without_gil([&] {
    return std::unique_ptr<Linear>(
        new Linear{LinearSolver(std::move(A), options, std::move(system))});
  });
}

py::array solve(Linear& linear, const ArrayLike& b, const ArrayLike& guess) {
  const Fields right(b, "b");
  Fields x = right;
  x.values.setZero();
  if (!guess.is_none()) x.values = Fields(guess, "guess").values;
  linear.latest =
      linear.use([&](LinearSolver& solver) { return solver.solve(right.values, x.values); });
  return x.array();
}

WallConditions wall_conditions(const ArrayLike& where, const ArrayLike& normals,
                               const Operator& gradient, const ArrayLike& flux,
                               const ArrayLike& transfer) {
  WallConditions walls{.points = points(where, "points", static_cast<int>(gradient.axes[0].cols())),
                       .normals = positions(normals, "normals"),
                       .gradient = gradient.axes};
  const auto count = static_cast<Eigen::Index>(walls.points.size());
  walls.flux = optional_vector(flux, "flux", count);
  walls.transfer = optional_vector(transfer, "transfer", count);
  return walls;
}

BoundaryConditions boundary_conditions(const Cloud& cloud, const ArrayLike& fixed,
                                       const ArrayLike& fixed_values, const WallConditions* walls) {
  BoundaryConditions conditions{.fixed = {.points = points(fixed, "fixed", cloud.size())}};
  conditions.fixed.values = optional_vector(
      fixed_values, "fixed_values", static_cast<Eigen::Index>(conditions.fixed.points.size()));
  if (walls) conditions.walls = *walls;
  return conditions;
}

std::unique_ptr<Diffusion> implicit_diffusion(const Cloud& cloud, const Operator& laplacian,
                                              double time_step, double diffusivity, double theta,
                                              const ArrayLike& source, const ArrayLike& fixed,
                                              const ArrayLike& fixed_values,
                                              const WallConditions* walls,
                                              const SolverOptions& solver) {
  const BoundaryConditions conditions = boundary_conditions(cloud, fixed, fixed_values, walls);
  const DiffusionOptions options{.diffusivity = diffusivity,
                                 .time_step = time_step,
                                 .theta = theta,
                                 .source = optional_vector(source, "source", cloud.size()),
                                 .solver = solver};
  return without_gil([&] {
    return std::unique_ptr<Diffusion>(
        new Diffusion{ImplicitDiffusion(cloud, laplacian, conditions, options)});
  });
}

/// Other points and their conditions.
template <class Solver>
void update(Shared<Solver>& shared, const Cloud& cloud, const Operator& laplacian,
            const ArrayLike& fixed, const ArrayLike& fixed_values, const WallConditions* walls) {
  const BoundaryConditions conditions = boundary_conditions(cloud, fixed, fixed_values, walls);
  shared.use([&](Solver& solver) { solver.update(cloud, laplacian, conditions); });
}

std::unique_ptr<Pressure> poisson(const Cloud& cloud, const Operator& laplacian,
                                  const ArrayLike& fixed, const ArrayLike& fixed_values,
                                  const WallConditions* walls, const SolverOptions& solver) {
  const BoundaryConditions conditions = boundary_conditions(cloud, fixed, fixed_values, walls);
  return without_gil([&] {
    return std::unique_ptr<Pressure>(new Pressure{Poisson(cloud, laplacian, conditions, solver)});
  });
}

py::array solve_poisson(Pressure& pressure, const ArrayLike& f, const ArrayLike& guess) {
  const Fields right(f, "f");
  Fields u = right;
  u.values.setZero();
  if (!guess.is_none()) u.values = Fields(guess, "guess").values;
  if (right.values.cols() != 1 || u.values.cols() != 1)
    throw InvalidInput("f and guess must have one column");
  pressure.latest = pressure.use(
      [&](Poisson& solver) { return solver.solve(right.values.col(0), u.values.col(0)); });
  return u.array();
}

using Step = SolveReport (ImplicitDiffusion::*)(Eigen::Ref<Eigen::MatrixXd> u);

template <Step step>
py::array stepped(Diffusion& diffusion, const ArrayLike& u) {
  Fields fields(u, "u");
  diffusion.latest =
      diffusion.use([&](ImplicitDiffusion& heat) { return (heat.*step)(fields.values); });
  return fields.array();
}

void bind_options(py::module_& m) {
  py::class_<SolverOptions>(m, "SolverOptions", "How a linear system is to be solved.")
      .def(py::init(&solver_options), py::kw_only(), py::arg("method") = "auto",
           py::arg("tolerance") = SolverOptions().tolerance,
           py::arg("max_iterations") = SolverOptions().max_iterations,
           py::arg("ordering") = "coordinates", py::arg("memory") = 0.0, py::arg("threads") = 0,
           py::arg("solves") = SolverOptions().solves, py::arg("mean") = py::none(),
           R"(method: "auto" looks at the matrix; "cholesky" for symmetric positive definite
  ones, "lu", "krylov", "multigrid" on the points.
tolerance: largest relative residual |b - A x| / |b|, 0 to 1. max_iterations: for each
  right-hand side.
ordering: in which a factorisation eliminates: "coordinates" (of the cloud), "amd", "metis".
memory: bytes that a factorisation may take; 0: three quarters of the machine's.
threads: 0: as many as OpenMP offers. solves: about how many right-hand sides each matrix is for,
  by which "auto" weighs preparing against solving; 0: 100, of a steady problem 1.
mean: by volume, of solutions that any constant may be added to; what is then taken from b so
  that there is one is SolveReport.removed. None: such a matrix is an error.
Raises InvalidInput for a name that is not one of these; numbers are checked by the solver.)")
      .def_property_readonly(
          "method", [](const SolverOptions& o) { return name(o.method); }, "As given")
      .def_readonly("tolerance", &SolverOptions::tolerance, "As given")
      .def_readonly("max_iterations", &SolverOptions::max_iterations, "As given")
      .def_property_readonly("ordering", &ordering_name, "As given")
      .def_readonly("memory", &SolverOptions::memory, "Bytes")
      .def_readonly("threads", &SolverOptions::threads, "As given")
      .def_readonly("solves", &SolverOptions::solves, "As given")
      .def_readonly("mean", &SolverOptions::mean, "As given");
}

void bind_reports(py::module_& m) {
  py::class_<FactorReport>(m, "FactorReport", "What a factorisation took.")
      .def_readonly("description", &FactorReport::description, "For people")
      .def_readonly("entries", &FactorReport::entries, "Of L, or of L and U")
      .def_readonly("flops", &FactorReport::flops, "0: not known")
      .def_readonly("bytes", &FactorReport::bytes, "Of memory")
      .def_readonly("analyse_seconds", &FactorReport::analyse_seconds,
                    "Ordering and symbolic analysis")
      .def_readonly("factor_seconds", &FactorReport::factor_seconds,
                    "The latest numerical factorisation");
  py::class_<SolverReport>(m, "SolverReport", "What a linear system is solved with, and why.")
      .def_property_readonly(
          "method", [](const SolverReport& r) { return name(r.method); },
          "\"cholesky\", \"lu\", \"krylov\" or \"multigrid\"")
      .def_readonly("description", &SolverReport::description, "For people")
      .def_readonly("reason", &SolverReport::reason, "Why this method")
      .def_readonly("unknowns", &SolverReport::unknowns, "Their number")
      .def_readonly("factor", &SolverReport::factor,
                    "A FactorReport; in a Krylov method the preconditioner's, if that is a factor")
      .def_readonly("caution", &SolverReport::caution,
                    "Rows that may keep a Krylov method from converging; empty: none");
  py::class_<SolveReport>(m, "SolveReport", "How a solve went.")
      .def_readonly("residual", &SolveReport::residual,
                    "True relative residual |b - A x| / |b|, the largest of all columns")
      .def_readonly("iterations", &SolveReport::iterations,
                    "Of a Krylov method, all columns together; else steps of refinement")
      .def_readonly("seconds", &SolveReport::seconds, "That it took")
      .def_readonly("removed", &SolveReport::removed,
                    "With a mean: the largest constant that was taken from a right-hand side");
}

constexpr auto linear_solver_doc =
    R"(matrix: n x n, a scipy.sparse matrix (of any format; copied).
options: SolverOptions.
cloud: the points of the rows: their coordinates give the order of elimination, their volumes
  scale rows that are tried for symmetry.
walls: rows that hold a boundary condition rather than the equation of the others (indices or a
  mask).
Raises InvalidInput if sizes disagree, an entry is not finite, a row has only zeros, or Cholesky
is asked for and the matrix is not symmetric; SolverError if it is singular, or not positive
definite for Cholesky.)";

void bind_linear(py::module_& m) {
  py::class_<Linear>(m, "LinearSolver",
                     R"(Solves A x = b for many b: the matrix is looked at and factorised once.

A symmetric positive definite matrix goes to Cholesky, another to LU or BiCGSTAB; `report` tells
what was chosen and why. Threads that solve with the same object take turns.)")
      .def(py::init(&linear_solver), py::arg("matrix"), py::arg("options") = SolverOptions(),
           py::arg("cloud") = py::none(), py::arg("walls") = py::none(), linear_solver_doc)
      .def("solve", &solve, py::arg("b"), py::arg("guess") = py::none(),
           R"(x, of the shape of b: n, or n x k for k right-hand sides.

guess: where iterations start from, in the same shape; None: zero.
Raises InvalidInput if sizes disagree or a number is not finite; SolverError if the residual
stays above the tolerance and above what rounding allows.)")
      .def(
          "refactor",
          [](Linear& linear, const SparseLike& matrix) {
            SparseMatrix A = sparse(matrix, "matrix");
            linear.use([&](LinearSolver& solver) { solver.refactor(std::move(A)); });
          },
          py::arg("matrix"),
          R"(Other values in the same pattern; the symbolic analysis is kept where the method
remains, and multigrid's coarser points where the values are nearly multiples.

Raises what the constructor raises, after which there is nothing to solve with until another
refactor(); InvalidInput if the pattern differs, and all is as before.)")
      .def_property_readonly(
          "report",
          [](Linear& linear) {
            return linear.use([](const LinearSolver& solver) { return solver.report(); });
          },
          "A SolverReport: what the system is solved with, and why")
      .def_property_readonly(
          "latest", [](const Linear& solver) { return solver.latest; },
          "A SolveReport: how the latest solve() went; None before the first");
}

void bind_walls(py::module_& m) {
  py::class_<WallConditions>(
      m, "WallConditions",
      R"(Points where transfer u + n . grad u = flux holds instead of the equation.)")
      .def(py::init(&wall_conditions), py::arg("points"), py::arg("normals"), py::arg("gradient"),
           py::arg("flux") = py::none(), py::arg("transfer") = py::none(),
           R"(points: m indices or a mask, none of them fixed.
normals: m x d (m in one dimension), not 0, outward by convention; their length, usually 1,
  multiplies grad u.
gradient: an Operator assembled with rows=points; copied.
flux: m numbers; None: 0. transfer: m numbers >= 0 (1/length); None: 0.
Raises InvalidInput if a shape or a point is wrong; ImplicitDiffusion checks the rest.)");
}

constexpr auto implicit_diffusion_doc =
    R"(laplacian: an Operator with all n rows; copied.
time_step: dt > 0; math.inf: the steady problem, solved by a single step from any u.
diffusivity: nu >= 0, length^2/time.
theta: 1: backward Euler, 0.5: Crank-Nicolson (see damped_step()); 0.5 to 1.
source: f, n numbers; None: 0.
fixed: points whose value is known, indices or a mask. fixed_values: one for each, in the order
  of the indices (of a mask: ascending); None: each keeps the value that it has in u.
walls: WallConditions. solver: SolverOptions.
Raises InvalidInput if sizes disagree, a number is out of range, or a point has two conditions;
SolverError if the system is singular.)";

constexpr auto damped_step_doc =
    R"(As step(), by two backward Euler steps of half the length in place of one by
Crank-Nicolson; they have the same matrix. As the first step from a field that jumps or does not
meet the walls' conditions it damps what would oscillate, and those that follow are of order 2
(Rannacher).

Raises what step() raises, InvalidInput if theta is not 0.5.)";

constexpr auto update_doc =
    R"(Other points, or the same ones elsewhere, and the conditions there; what else was given
remains, and multigrid keeps its coarser points as long as they serve.

Raises what the constructor raises, after which there may be nothing to solve with until another
update().)";

template <class Solver>
void bind_common(py::class_<Shared<Solver>>& c) {
  c.def("update", &update<Solver>, py::arg("cloud"), py::arg("laplacian"), py::kw_only(),
        py::arg("fixed") = py::none(), py::arg("fixed_values") = py::none(),
        py::arg("walls") = py::none(), update_doc)
      .def_property_readonly(
          "solver",
          [](Shared<Solver>& shared) {
            return shared.use([](const Solver& solver) { return solver.solver(); });
          },
          "A SolverReport: what the system is solved with, and why")
      .def_property_readonly(
          "latest", [](const Shared<Solver>& shared) { return shared.latest; },
          "A SolveReport: how the latest solve went; None before the first");
}

void bind_diffusion(py::module_& m) {
  py::class_<Diffusion> c(m, "ImplicitDiffusion", R"(Steps du/dt = nu lap u + f by the theta
method:

    (I/dt - theta nu Psi) u_new = (I/dt + (1 - theta) nu Psi) u + f

with a Laplacian's matrix Psi, at points without a condition. Near the edge of an open cloud
without any, zoc schemes imply zero flux. The matrix is factorised once; step() then costs a
solve. Threads that step with the same object take turns.)");
  c.def(py::init(&implicit_diffusion), py::arg("cloud"), py::arg("laplacian"), py::kw_only(),
        py::arg("time_step"), py::arg("diffusivity") = DiffusionOptions().diffusivity,
        py::arg("theta") = DiffusionOptions().theta, py::arg("source") = py::none(),
        py::arg("fixed") = py::none(), py::arg("fixed_values") = py::none(),
        py::arg("walls") = py::none(), py::arg("solver") = SolverOptions(), implicit_diffusion_doc)
      .def("step", &stepped<&ImplicitDiffusion::step>, py::arg("u"),
           R"(u one step later, a new array; the argument (n, or n x k for k fields at once)
remains what it is.

Raises InvalidInput if the size is wrong or a value is not finite (names the point); SolverError
if the residual stays above the tolerance.)")
      .def("damped_step", &stepped<&ImplicitDiffusion::damped_step>, py::arg("u"), damped_step_doc)
      .def(
          "set_time_step",
          [](Diffusion& diffusion, double time_step) {
            diffusion.use([&](ImplicitDiffusion& heat) { heat.set_time_step(time_step); });
          },
          py::arg("time_step"),
          "Another time step: the matrix is factorised anew. Raises what the constructor raises.");
  bind_common(c);
}

void bind_poisson(py::module_& m) {
  py::class_<Pressure> c(m, "Poisson", R"(Solves lap u = f for many f, on points that may move.

Where nothing fixes u, a constant is taken from f so that there is a solution (removed, in
`latest`), and u is the one of the mean given in SolverOptions, or else of mean 0. Threads that
solve with the same object take turns.)");
  c.def(py::init(&poisson), py::arg("cloud"), py::arg("laplacian"), py::kw_only(),
        py::arg("fixed") = py::none(), py::arg("fixed_values") = py::none(),
        py::arg("walls") = py::none(), py::arg("solver") = SolverOptions(),
        R"(laplacian: an Operator with all n rows; copied.
fixed: points whose value is known, indices or a mask. fixed_values: one for each; None: each
  keeps what it has in `guess`.
walls: WallConditions. solver: SolverOptions.
Raises what ImplicitDiffusion raises.)")
      .def("solve", &solve_poisson, py::arg("f"), py::arg("guess") = py::none(),
           R"(u, n numbers. f: n numbers, those at fixed points and walls without effect.

guess: where iterations start from; None: zero.
Raises InvalidInput if a size is wrong or a number is not finite; SolverError if the residual
stays above the tolerance.)");
  bind_common(c);
}

}  // namespace

void bind_solver(py::module_& m) {
  bind_options(m);
  bind_reports(m);
  bind_linear(m);
  bind_walls(m);
  bind_diffusion(m);
  bind_poisson(m);
}

}  // namespace gradpsi::python
