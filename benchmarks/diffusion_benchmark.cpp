// One implicit step, I - dt nu Psi, by every solver at hand: a CSV with a line per solver.
//
//     gradpsi_diffusion_benchmark DIMENSION POINTS_PER_SIDE DT_NU_OVER_DX2 THREADS [--slow]
//
// Points are a lattice jittered by 0.2 cells, its outermost layer fixed; Psi is laplacian-mixed-zoc
// (symmetric) and laplacian-mixed-soc (not), h/dx = 3 in 2D and 2.6 in 3D. Iterations stop at a relative
// residual of 1e-8. "gradpsi" lines go through LinearSolver, "Eigen" lines through Eigen's wrapper or own
// solver. --slow adds those that take minutes from 100,000 points on.

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <Eigen/UmfPackSupport>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <string>

namespace {

constexpr double tolerance = 1e-8;
using ByColumns = Eigen::SparseMatrix<double>;

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double seconds_of(const std::function<void()>& work) {
  const double start = seconds();
  work();
  return seconds() - start;
}

/// The unknowns' system, their points and a right-hand side.
struct System {
  gradpsi::SparseMatrix matrix;
  gradpsi::Cloud points;
  Eigen::VectorXd b;
};

System make_system(const std::string& scheme, int dimension, int side, double ratio, int threads) {
  const gradpsi::Cloud cloud =
      make_cloud(gradpsi::Lattice{.dimension = dimension, .points_per_side = side, .jitter = 0.2});
  const double dx = cloud.spacing();
  const auto near = find_neighbours(cloud, (dimension == 3 ? 2.6 : 3) * dx, threads);
  const auto psi = assemble(scheme, cloud, near,
                            {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = threads})
                       .axes.front();
  std::vector<int> place(cloud.size(), -1), unknowns;
  for (int i = 0; i < cloud.size(); ++i) {
    const auto x = cloud.positions().row(i);
    if (x.minCoeff() < dx || x.maxCoeff() > 1 - dx) continue;
    place[i] = static_cast<int>(unknowns.size());
    unknowns.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(unknowns.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(psi.nonZeros());
  for (const int i : unknowns)
    for (gradpsi::SparseMatrix::InnerIterator a(psi, i); a; ++a)
      if (place[a.col()] >= 0)
        entries.emplace_back(place[i], place[a.col()],
                             (a.col() == i ? 1 : 0) - ratio * dx * dx * a.value());
  System system{gradpsi::SparseMatrix(n, n),
                gradpsi::Cloud(cloud.positions()(unknowns, Eigen::all),
                               {.volumes = cloud.volumes()(unknowns)}),
                Eigen::VectorXd(n)};
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto x = system.points.positions().row(k).array();
    system.b[k] = (3.14159 * x).sin().prod() + 0.1 * std::sin(37.0 * static_cast<double>(k));
  }
  return system;
}

struct Line {
  std::string solver;
  double analyse, factor, solve, entries_per_row, gigabytes;
  long iterations;
  double residual;
};

void print(const Line& line) {
  std::printf("%s,%.3f,%.3f,%.4f,%.0f,%.3g,%ld,%.1e\n", line.solver.c_str(), line.analyse,
              line.factor, line.solve, line.entries_per_row, line.gigabytes, line.iterations,
              line.residual);
  std::fflush(stdout);
}

double residual(const System& system, const Eigen::VectorXd& x) {
  return (system.b - system.matrix * x).norm() / system.b.norm();
}

/// Without volumes a Krylov method has no coarser points: the diagonal preconditions.
void run_gradpsi(const std::string& name, const System& system, gradpsi::Method method,
                 bool with_volumes, gradpsi::Ordering ordering, int threads) {
  gradpsi::SystemPoints points{with_volumes ? system.points
                                            : gradpsi::Cloud(system.points.positions())};
  gradpsi::LinearSolver solver(
      system.matrix,
      {.method = method, .tolerance = tolerance, .ordering = ordering, .threads = threads}, points);
  const auto& report = solver.report();
  Eigen::VectorXd x = system.b;
  if (!report.iterates) solver.solve(system.b, x);  // touches its memory
  x = system.b;
  const gradpsi::SolveReport solve = solver.solve(system.b, x);
  print({"gradpsi " + name, report.factor.analyse_seconds, report.factor.factor_seconds,
         solve.seconds, report.factor.entries / report.unknowns, report.factor.bytes / 1e9,
         solve.iterations, solve.residual});
}

template <class Solver>
void run_eigen(const std::string& name, const System& system,
               const std::function<double(const Solver&)>& entries = {}) {
  const typename Solver::MatrixType A = system.matrix;
  Solver solver;
  if constexpr (requires { solver.setTolerance(tolerance); }) {
    solver.setTolerance(tolerance);
    solver.setMaxIterations(20'000);
  }
  Line line{"Eigen " + name, 0, 0, 0, 0, 0, 0, 0};
  line.analyse = seconds_of([&] { solver.analyzePattern(A); });
  line.factor = seconds_of([&] { solver.factorize(A); });
  Eigen::VectorXd x;
  line.solve = seconds_of([&] {
    if constexpr (requires { solver.solveWithGuess(system.b, x); })
      x = solver.solveWithGuess(system.b, system.b);
    else
      x = solver.solve(system.b);
  });
  if constexpr (requires { solver.iterations(); }) line.iterations = solver.iterations();
  if (entries) line.entries_per_row = entries(solver) / static_cast<double>(A.rows());
  line.residual = residual(system, x);
  print(line);
}

void symmetric(const System& system, int threads, bool slow) {
  using gradpsi::Method, gradpsi::Ordering;
  run_gradpsi("Cholesky by coordinates", system, Method::Cholesky, true, Ordering::Coordinates,
              threads);
  run_gradpsi("Cholesky by AMD", system, Method::Cholesky, true, Ordering::Amd, threads);
  run_gradpsi("Cholesky by METIS", system, Method::Cholesky, true, Ordering::Metis, threads);
  run_gradpsi("CG with the diagonal", system, Method::Krylov, false, Ordering::Coordinates,
              threads);
  run_gradpsi("CG with multigrid", system, Method::Multigrid, true, Ordering::Coordinates, threads);
  run_eigen<Eigen::ConjugateGradient<gradpsi::SparseMatrix, Eigen::Lower | Eigen::Upper>>(
      "CG with the diagonal", system);
  run_eigen<Eigen::ConjugateGradient<
      ByColumns, Eigen::Lower,
      Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>>>>(
      "CG with incomplete Cholesky", system);
  if (slow)
    run_eigen<Eigen::SimplicialLDLT<ByColumns>>("SimplicialLDLT", system, [](const auto& solver) {
      return static_cast<double>(solver.matrixL().nestedExpression().nonZeros());
    });
}

void unsymmetric(const System& system, int threads, bool slow) {
  using gradpsi::Method, gradpsi::Ordering;
  run_gradpsi("LU by coordinates", system, Method::Lu, true, Ordering::Coordinates, threads);
  run_gradpsi("BiCGSTAB with the diagonal", system, Method::Krylov, false, Ordering::Coordinates,
              threads);
  run_gradpsi("BiCGSTAB with multigrid", system, Method::Multigrid, true, Ordering::Coordinates,
              threads);
  run_eigen<Eigen::BiCGSTAB<gradpsi::SparseMatrix>>("BiCGSTAB with the diagonal", system);
  run_eigen<Eigen::BiCGSTAB<gradpsi::SparseMatrix, Eigen::IncompleteLUT<double>>>(
      "BiCGSTAB with ILUT", system);
  run_eigen<Eigen::UmfPackLU<ByColumns>>("UmfPackLU", system);
  if (slow) run_eigen<Eigen::SparseLU<ByColumns>>("SparseLU", system);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "Usage: %s DIMENSION POINTS_PER_SIDE DT_NU_OVER_DX2 THREADS [--slow]\n",
                 argv[0]);
    return 2;
  }
  const int dimension = std::atoi(argv[1]), side = std::atoi(argv[2]), threads = std::atoi(argv[4]);
  const double ratio = std::atof(argv[3]);
  const bool slow = argc > 5 && std::string(argv[5]) == "--slow";
  Eigen::setNbThreads(threads);
  for (const bool is_symmetric : {true, false}) {
    const System system = make_system(is_symmetric ? "laplacian-mixed-zoc" : "laplacian-mixed-soc",
                                      dimension, side, ratio, threads);
    std::printf("\n# %s, %dD, %ld unknowns, dt nu / dx^2 = %g, threads %d\n",
                is_symmetric ? "symmetric" : "unsymmetric", dimension,
                static_cast<long>(system.matrix.rows()), ratio, threads);
    std::printf("solver,analyse_s,factor_s,solve_s,entries_per_row,GB,iterations,residual\n");
    (is_symmetric ? symmetric : unsymmetric)(system, threads, slow);
  }
}
