// Systems of implicit problems by multigrid and by what else there is: a CSV with a line for each.
//
//     gradpsi_multigrid_benchmark STUDY.. [--threads N] [--largest POINTS]
//
// Studies: sizes, schemes, steps, hard, memory. Points are a lattice, its outermost layer fixed; a source drives them;
// iterations start from zero and stop at a relative residual of 1e-8 of the matrix itself. "auto" may choose for a
// single solve. Where it was built with PETSc, BoomerAMG (hypre) preconditions the same iterations.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <limits>
#include <span>
#include <string>
#include <vector>

#if GRADPSI_WITH_PETSC
#include <petscksp.h>
#endif

namespace {

using gradpsi::Cloud, gradpsi::DenseVector, gradpsi::SparseMatrix;
constexpr double tolerance = 1e-8;
constexpr double steady = std::numeric_limits<double>::infinity();

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Scene {
  std::string name = {};
  int dimension = 2;
  double points = 1e5;
  std::string scheme = "laplacian-mixed-zoc";
  double ratio = 3;  // h/dx
  double jitter = 0.3;
  double stiffness = steady;  // dt nu / dx^2
  double grading = 1, jump = 1;
  bool walls = false;
};

struct Problem {
  SparseMatrix matrix = {};
  gradpsi::SystemPoints points = {};
  DenseVector b = {};
  bool symmetric = false;
};

/// Which points are fixed, which are walls (those of the last coordinate's sides).
gradpsi::BoundaryConditions conditions(const Scene& scene, const Cloud& cloud,
                                       const DenseVector& spacing, const gradpsi::Neighbours& near,
                                       int threads) {
  gradpsi::BoundaryConditions result;
  std::vector<int>& at = result.walls.points;
  const int last = scene.dimension - 1;
  for (int i = 0; i < cloud.size(); ++i) {
    const auto x = cloud.positions().row(i).array();
    const double layer = scene.grading > 1 ? 2 * spacing[i] : spacing[i];
    const bool at_side =
        last > 0 && (x.head(last).minCoeff() < layer || x.head(last).maxCoeff() > 1 - layer);
    const bool at_end = x[last] < layer || x[last] > 1 - layer;
    if (scene.walls && at_end && !at_side)
      at.push_back(i);
    else if (at_side || at_end)
      result.fixed.points.push_back(i);
  }
  if (at.empty()) return result;
  result.walls.normals = gradpsi::Positions::Zero(std::ssize(at), scene.dimension);
  for (std::size_t k = 0; k < at.size(); ++k)
    result.walls.normals(static_cast<Eigen::Index>(k), last) =
        cloud.positions()(at[k], last) < 0.5 ? -1 : 1;
  result.walls.gradient =
      assemble("gradient-direct-foc", cloud, near,
               {.on_degenerate = gradpsi::OnDegenerate::Lower, .rows = at, .threads = threads})
          .axes;
  return result;
}

/// A checkerboard of 4 cells a side.
DenseVector checkerboard(const Cloud& cloud, double jump) {
  DenseVector result = DenseVector::Ones(cloud.size());
  for (int i = 0; i < cloud.size(); ++i) {
    double cells = 0;
    for (int a = 0; a < cloud.dimension(); ++a) cells += std::floor(4 * cloud.positions()(i, a));
    if (std::fmod(cells, 2) > 0.5) result[i] = jump;
  }
  return result;
}

Problem make(const Scene& scene, int threads) {
  const int side = static_cast<int>(std::lround(std::pow(scene.points, 1.0 / scene.dimension)));
  const Cloud cloud = gradpsi::make_cloud({.dimension = scene.dimension,
                                           .points_per_side = side,
                                           .jitter = scene.jitter,
                                           .grading = scene.grading});
  const double dx = cloud.spacing();
  const DenseVector spacing = cloud.volumes().array().pow(1.0 / scene.dimension);
  const DenseVector support =
      scene.ratio * (scene.grading > 1 ? spacing : DenseVector::Constant(1, dx));
  const gradpsi::Neighbours near = find_neighbours(cloud, support, threads);
  gradpsi::Operator psi =
      assemble(scene.scheme, cloud, near,
               {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = threads});
  if (scene.jump > 1)
    psi =
        with_conductivity(std::move(psi), checkerboard(cloud, scene.jump), gradpsi::Mean::Harmonic);
  DenseVector source(cloud.size());
  for (int i = 0; i < cloud.size(); ++i)
    source[i] = (M_PI * cloud.positions().row(i).array()).sin().prod() + 0.1 * std::sin(37.0 * i);
  gradpsi::DiffusionSystem system(
      cloud, psi, conditions(scene, cloud, spacing, near, threads),
      {.time_step = scene.stiffness < steady ? scene.stiffness * dx * dx : steady,
       .source = source});
  const DenseVector u = DenseVector::Zero(cloud.size());
  Problem result;
  result.b.resize(std::ssize(system.rows()));
  system.right_hand_side(std::span(u.data(), static_cast<std::size_t>(u.size())), {},
                         std::span(result.b.data(), static_cast<std::size_t>(result.b.size())));
  result.matrix = system.take_matrix();
  result.points = system.take_points();
  result.symmetric =
      !scene.walls && scene.grading == 1 && scene.scheme.find("-zoc") != std::string::npos;
  return result;
}

struct Line {
  std::string solver;
  double setup = 0, solve = 0;
  int iterations = 0;
  double residual = 0, bytes = 0;
};

void print(const Scene& scene, const Problem& problem, const Line& line) {
  std::printf(
      "%s,%dD,%ld,%.1f,%s,%.3f,%.3f,%.3f,%d,%.1e,%.0f\n", scene.name.c_str(), scene.dimension,
      static_cast<long>(problem.matrix.rows()),
      static_cast<double>(problem.matrix.nonZeros()) / static_cast<double>(problem.matrix.rows()),
      line.solver.c_str(), line.setup, line.solve, line.setup + line.solve, line.iterations,
      line.residual, line.bytes / static_cast<double>(problem.matrix.rows()));
  std::fflush(stdout);
}

/// By a method of gradpsi's; without volumes a Krylov method has but the diagonal.
Line run(const Problem& problem, gradpsi::Method method, bool with_volumes, int threads) {
  Line line{std::string(name(method)) + (with_volumes ? "" : " with the diagonal")};
  gradpsi::SystemPoints points = problem.points;
  if (!with_volumes) points.cloud = Cloud(points.cloud.positions());
  SparseMatrix matrix = problem.matrix;
  const double start = seconds();
  try {
    gradpsi::LinearSolver solver(std::move(matrix),
                                 {.method = method,
                                  .tolerance = tolerance,
                                  .max_iterations = 3'000,
                                  .threads = threads,
                                  .solves = 1},
                                 std::move(points));
    const double ready = seconds();
    line.setup = ready - start;
    DenseVector x = DenseVector::Zero(problem.b.size());
    const gradpsi::SolveReport report = solver.solve(problem.b, x);
    line.solve = seconds() - ready;
    line.iterations = report.iterations;
    line.residual = report.residual;
    line.bytes = solver.report().factor.bytes;
    if (method == gradpsi::Method::Auto)
      line.solver += " (" + std::string(name(solver.report().method)) + ")";
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", line.solver.c_str(), error.what());
    line.residual = std::numeric_limits<double>::quiet_NaN();
    line.solve = seconds() - start;
  }
  return line;
}

#if GRADPSI_WITH_PETSC
/// Those that do best with rows as long as these.
void set_options(const Scene& scene) {
  const auto set = [](const char* option, const char* value) {
    PetscOptionsSetValue(nullptr, option, value);
  };
  set("-pc_hypre_type", "boomeramg");
  set("-pc_hypre_boomeramg_coarsen_type", "HMIS");
  set("-pc_hypre_boomeramg_interp_type", "ext+i");
  set("-pc_hypre_boomeramg_P_max", "4");
  if (scene.dimension == 3) set("-pc_hypre_boomeramg_agg_nl", "1");
}

/// Rows times volumes, which makes a symmetric matrix of one that is symmetric in that sense.
Line run_boomeramg(const Scene& scene, const Problem& problem) {
  Line line{"BoomerAMG"};
  SparseMatrix A = problem.matrix;
  DenseVector b = problem.b, x = DenseVector::Zero(b.size());
  if (problem.symmetric) {
    const DenseVector& volumes = problem.points.cloud.volumes();
    A = volumes.asDiagonal() * A;
    b = b.cwiseProduct(volumes);
  }
  set_options(scene);
  const auto n = static_cast<PetscInt>(A.rows());
  const double start = seconds();
  Mat matrix;
  Vec right, solution;
  KSP solver;
  PC preconditioner;
  MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, n, n, A.outerIndexPtr(), A.innerIndexPtr(),
                            A.valuePtr(), &matrix);
  VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, b.data(), &right);
  VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, x.data(), &solution);
  KSPCreate(PETSC_COMM_SELF, &solver);
  KSPSetOperators(solver, matrix, matrix);
  KSPSetType(solver, problem.symmetric ? KSPCG : KSPBCGS);
  KSPGetPC(solver, &preconditioner);
  PCSetType(preconditioner, PCHYPRE);
  KSPSetNormType(solver, KSP_NORM_UNPRECONDITIONED);
  if (!problem.symmetric) KSPSetPCSide(solver, PC_RIGHT);
  KSPSetTolerances(solver, tolerance, PETSC_DEFAULT, PETSC_DEFAULT, 300);
  KSPSetFromOptions(solver);
  KSPSetUp(solver);
  const double ready = seconds();
  KSPSolve(solver, right, solution);
  line.setup = ready - start;
  line.solve = seconds() - ready;
  PetscInt iterations;
  KSPGetIterationNumber(solver, &iterations);
  line.iterations = static_cast<int>(iterations);
  line.residual = (problem.b - problem.matrix * x).norm() / problem.b.norm();
  KSPDestroy(&solver);
  VecDestroy(&solution);
  VecDestroy(&right);
  MatDestroy(&matrix);
  return line;
}
#endif

struct Wanted {
  bool diagonal = true, factor = false, boomeramg = true;
};

void run(const Scene& scene, const Wanted& wanted, int threads) {
  using gradpsi::Method;
  const Problem problem = make(scene, threads);
  print(scene, problem, run(problem, Method::Multigrid, true, threads));
  print(scene, problem, run(problem, Method::Auto, true, threads));
  if (wanted.diagonal) print(scene, problem, run(problem, Method::Krylov, false, threads));
  if (wanted.factor)
    print(scene, problem,
          run(problem, problem.symmetric ? Method::Cholesky : Method::Lu, true, threads));
#if GRADPSI_WITH_PETSC
  if (wanted.boomeramg) print(scene, problem, run_boomeramg(scene, problem));
#endif
}

const std::vector<Scene> schemes = {{.scheme = "laplacian-mixed-zoc"},
                                    {.scheme = "laplacian-mixed-soc"},
                                    {.scheme = "laplacian-mixed-soc-ls"},
                                    {.scheme = "laplacian-positive", .ratio = 2.5},
                                    {.scheme = "laplacian-ls-2"},
                                    {.scheme = "laplacian-ls-4", .ratio = 4.5},
                                    {.scheme = "laplacian-ls-6", .ratio = 6}};

void sizes(double largest, int threads) {
  for (const int dimension : {2, 3})
    for (const double jitter : {0.0, 0.3})
      for (double points = 1e4; points <= largest * 1.01; points *= 10)
        run({.name = "sizes jitter " + std::to_string(jitter).substr(0, 3),
             .dimension = dimension,
             .points = points,
             .ratio = dimension == 3 ? 2.6 : 3,
             .jitter = jitter},
            {.diagonal = jitter > 0, .factor = jitter > 0 && points < (dimension == 3 ? 5e4 : 5e5)},
            threads);
}

void by_scheme(double largest, int threads) {
  for (Scene scene : schemes)
    for (double points = largest / 10; points <= largest * 1.01; points *= 10) {
      scene.name = scene.scheme;
      scene.points = points;
      run(scene, {.diagonal = false}, threads);
    }
  for (Scene scene : schemes) {
    if (scene.ratio > 3) continue;
    scene.name = scene.scheme;
    scene.dimension = 3;
    scene.ratio = 2.6;
    scene.points = largest;
    run(scene, {.diagonal = false}, threads);
  }
}

void steps(double largest, int threads) {
  for (const int dimension : {2, 3})
    for (const char* scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"})
      for (const double stiffness : {1.0, 100.0, 1e4})
        run({.name = std::string(scheme) + " dt nu / dx^2 = " + std::to_string(int(stiffness)),
             .dimension = dimension,
             .points = largest,
             .scheme = scheme,
             .ratio = dimension == 3 ? 2.6 : 3,
             .stiffness = stiffness},
            {}, threads);
}

void hard(double largest, int threads) {
  const std::vector<Scene> scenes = {
      {.name = "walls", .walls = true},
      {.name = "walls mixed-soc", .scheme = "laplacian-mixed-soc", .walls = true},
      {.name = "walls 3D mixed-soc-ls",
       .dimension = 3,
       .scheme = "laplacian-mixed-soc-ls",
       .ratio = 2.6,
       .walls = true},
      {.name = "jump 1:1000", .jump = 1000},
      {.name = "positive graded 10:1", .scheme = "laplacian-positive", .ratio = 2.5, .grading = 10},
      {.name = "positive graded 100:1", .scheme = "laplacian-positive", .ratio = 3, .grading = 100},
      {.name = "mixed-soc-ls graded 10:1 k 2.5",
       .scheme = "laplacian-mixed-soc-ls",
       .ratio = 2.5,
       .grading = 10},
      {.name = "mixed-soc-ls graded 10:1", .scheme = "laplacian-mixed-soc-ls", .grading = 10},
      {.name = "mixed-soc graded 10:1", .scheme = "laplacian-mixed-soc", .grading = 10},
      {.name = "mixed-soc-ls graded 100:1", .scheme = "laplacian-mixed-soc-ls", .grading = 100},
      {.name = "3D mixed-soc-ls graded 5:1",
       .dimension = 3,
       .scheme = "laplacian-mixed-soc-ls",
       .ratio = 2.6,
       .grading = 5}};
  for (Scene scene : scenes) {
    scene.points = largest;
    run(scene, {}, threads);
  }
}

void memory(double largest, int threads) {
  for (const int dimension : {2, 3})
    for (double points = largest / 16; points <= largest * 1.01; points *= 4)
      run({.name = "memory",
           .dimension = dimension,
           .points = points,
           .ratio = dimension == 3 ? 2.6 : 3},
          {.diagonal = false, .boomeramg = false}, threads);
}

struct Study {
  const char* name;
  void (*run)(double largest, int threads);
  double largest;  // points
};
const Study studies[] = {{"sizes", sizes, 1e6},
                         {"schemes", by_scheme, 1e5},
                         {"steps", steps, 1e5},
                         {"hard", hard, 1e5},
                         {"memory", memory, 4e6}};

}  // namespace

int main(int argc, char** argv) {
  std::vector<const Study*> wanted;
  int threads = 1;
  double largest = 0;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--threads" && k + 1 < argc) {
      threads = std::atoi(argv[++k]);
    } else if (word == "--largest" && k + 1 < argc) {
      largest = std::atof(argv[++k]);
    } else {
      const Study* const study =
          std::ranges::find_if(studies, [&](const Study& s) { return word == s.name; });
      if (study == std::end(studies)) {
        std::fprintf(stderr, "no study is called '%s': sizes, schemes, steps, hard, memory\n",
                     word.c_str());
        return 2;
      }
      wanted.push_back(study);
    }
  }
#if GRADPSI_WITH_PETSC
  PetscInitialize(nullptr, nullptr, nullptr, nullptr);
  PetscPushErrorHandler(PetscAbortErrorHandler, nullptr);
#endif
  std::puts(
      "scene,dimension,unknowns,entries_per_row,solver,setup_s,solve_s,total_s,iterations,"
      "residual,bytes_per_point");
  for (const Study* study : wanted) study->run(largest > 0 ? largest : study->largest, threads);
#if GRADPSI_WITH_PETSC
  PetscFinalize();
#endif
}
