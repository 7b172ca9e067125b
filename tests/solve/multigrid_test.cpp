// Multigrid as a preconditioner: iterations that do not grow, on every matrix that the library makes.

#include <optional>
#include <string>

#include "solve/systems.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

struct Solved {
  int iterations;
  Eigen::VectorXd x;
  SolverReport report;
};

Solved solve(const SparseMatrix& A, const SystemPoints& points, const Eigen::VectorXd& b,
             int threads = 1) {
  LinearSolver solver(
      A,
      {.method = Method::Multigrid, .tolerance = 1e-8, .max_iterations = 100, .threads = threads},
      points);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  const int iterations = solver.solve(b, x).iterations;
  return {iterations, x, solver.report()};
}

struct Steady {
  std::string scheme = "laplacian-mixed-zoc";
  int dimension = 2;
  double ratio = 3;
  double jitter = 0.3, grading = 1, jump = 1;
  bool walls = false;

  /// The steady problem with its outermost layer fixed, or with walls along the last coordinate.
  Solved solve(int side, int threads = 1) const {
    const Cloud cloud = make_cloud(
        {.dimension = dimension, .points_per_side = side, .jitter = jitter, .grading = grading});
    const DenseVector s = cloud.volumes().array().pow(1.0 / dimension);
    const Neighbours near = find_neighbours(cloud, ratio * s);
    Operator psi = assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Lower});
    if (jump > 1) {
      DenseVector conductivity = DenseVector::Ones(cloud.size());
      for (int i = 0; i < cloud.size(); ++i)
        if ((cloud.positions().row(i).array() - 0.5).prod() > 0) conductivity[i] = jump;
      psi = with_conductivity(std::move(psi), conductivity, Mean::Harmonic);
    }
    DiffusionSystem system(cloud, psi, conditions(cloud, s, near),
                           {.time_step = infinity, .source = DenseVector::Ones(cloud.size())});
    DenseVector u = DenseVector::Zero(cloud.size()), b(std::ssize(system.rows()));
    system.right_hand_side(std::span(u.data(), u.size()), {}, std::span(b.data(), b.size()));
    return gradpsi::solve(system.matrix(), system.points(), b, threads);
  }

 private:
  BoundaryConditions conditions(const Cloud& cloud, const DenseVector& s,
                                const Neighbours& near) const {
    BoundaryConditions result;
    std::vector<int>& at = result.walls.points;
    for (int i = 0; i < cloud.size(); ++i) {
      const auto x = cloud.positions().row(i).array();
      const double layer = grading > 1 ? 2 * s[i] : s[i], last = x[dimension - 1];
      const auto sides = x.head(dimension - 1);
      if (walls && (last < layer || last > 1 - layer) && sides.minCoeff() > layer &&
          sides.maxCoeff() < 1 - layer)
        at.push_back(i);
      else if (x.minCoeff() < layer || x.maxCoeff() > 1 - layer)
        result.fixed.points.push_back(i);
    }
    if (!walls) return result;
    result.walls.normals = Positions::Zero(std::ssize(at), dimension);
    for (std::size_t k = 0; k < at.size(); ++k)
      result.walls.normals(k, dimension - 1) =
          cloud.positions()(at[k], dimension - 1) < 0.5 ? -1 : 1;
    result.walls.gradient = assemble("gradient-direct-foc", cloud, near,
                                     {.on_degenerate = OnDegenerate::Lower, .rows = at})
                                .axes;
    return result;
  }
};

TEST(Multigrid, IterationsDoNotGrowWithTheNumberOfPoints) {
  const std::vector<Steady> problems = {
      {.jitter = 0},
      {},
      {.scheme = "laplacian-mixed-soc"},
      {.scheme = "laplacian-mixed-soc-ls"},
      {.scheme = "laplacian-positive", .ratio = 2.5},
      {.scheme = "laplacian-ls-4", .ratio = 4.5},
      {.scheme = "laplacian-positive", .grading = 10},
      {.scheme = "laplacian-mixed-soc-ls", .grading = 10},
      {.walls = true},
      {.scheme = "laplacian-mixed-soc-ls", .walls = true},
  };
  for (const Steady& problem : problems) {
    const int coarse = problem.solve(40).iterations, fine = problem.solve(120).iterations;
    EXPECT_LE(fine, coarse + 3) << problem.scheme << ' ' << problem.grading << problem.walls;
    EXPECT_LE(fine, 15) << problem.scheme << ' ' << problem.grading << problem.walls;
  }
  for (const char* scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Steady problem{.scheme = scheme, .dimension = 3, .ratio = 2.6};
    const int coarse = problem.solve(12).iterations, fine = problem.solve(24).iterations;
    EXPECT_LE(fine, coarse + 3) << scheme;
    EXPECT_LE(fine, 13) << scheme;
  }
  const Steady line{.dimension = 1};
  EXPECT_LE(line.solve(20'000).iterations, 30);
}

TEST(Multigrid, BearsJumpsOfTheConductivity) {
  const Steady problem{.jump = 1000};
  EXPECT_LE(problem.solve(100).iterations, 20);
}

TEST(Multigrid, DoesNotDependOnThreads) {
  for (const char* scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Steady problem{.scheme = scheme, .walls = true};
    const Solved one = problem.solve(80, 1), three = problem.solve(80, 3);
    EXPECT_EQ(one.x, three.x);
  }
}

TEST(Multigrid, IsSymmetricWhereTheMatrixIs) {
  // Conjugate gradients take it for granted.
  const System system("laplacian-mixed-zoc", make_cloud({.points_per_side = 30, .jitter = 0.2}),
                      1e3);
  const Solved solved = solve(system.matrix, system.points, system.right_hand_sides(1));
  EXPECT_THAT(solved.report.description,
              HasSubstr("conjugate gradients preconditioned by multigrid on 2 levels"));
  EXPECT_LE(solved.iterations, 15);
}

TEST(Multigrid, WorksInPeriodicBoxes) {
  for (const int d : {1, 2, 3}) {
    const System system(
        "laplacian-mixed-soc",
        make_cloud(
            {.dimension = d, .points_per_side = d == 3 ? 14 : 50, .jitter = 0.2, .periodic = true}),
        1e4);
    EXPECT_LE(solve(system.matrix, system.points, system.right_hand_sides(1)).iterations, 15) << d;
  }
}

TEST(Multigrid, WorksOnAsFewUnknownsAsThereAre) {
  for (const int side : {2, 3, 5, 8}) {
    const Cloud cloud = make_cloud({.points_per_side = side});
    const Neighbours near = find_neighbours(cloud, 1.6 * cloud.spacing());
    SparseMatrix A = -0.01 * assemble("laplacian-mixed-zoc", cloud, near).matrix();
    for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1;
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
    const Solved solved = solve(A, {cloud}, b);
    EXPECT_LT((A * solved.x - b).norm(), 1e-7 * b.norm());
  }
}

TEST(Multigrid, WorksOnPartsThatAreNotConnected) {
  const Cloud part = make_cloud({.points_per_side = 30, .jitter = 0.2});
  Positions x(2 * part.size(), 2);
  x << part.positions(), part.positions().rowwise() + Eigen::RowVector2d(5, 3);
  DenseVector volumes(x.rows());
  volumes << part.volumes(), part.volumes();
  const System system("laplacian-mixed-zoc", Cloud(x, {.volumes = volumes}), 1e4);
  EXPECT_LE(solve(system.matrix, system.points, system.right_hand_sides(1)).iterations, 20);
}

TEST(Multigrid, OfAnotherMatrixIsAsGoodOnThePointsThatItHas) {
  const Cloud cloud = make_cloud({.points_per_side = 40, .jitter = 0.2, .periodic = true});
  const System first("laplacian-mixed-soc", cloud, 1e2), second("laplacian-mixed-soc", cloud, 1e5);
  const Eigen::VectorXd b = second.right_hand_sides(1);
  LinearSolver solver(first.matrix, {.method = Method::Multigrid, .tolerance = 1e-8}, first.points);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  solver.solve(b, x);
  solver.refactor(second.matrix);
  x.setZero();
  const int iterations = solver.solve(b, x).iterations;
  const Solved anew = solve(second.matrix, second.points, b);
  EXPECT_LE(iterations, anew.iterations + 1);
  EXPECT_LT((second.matrix * x - b).norm(), 1e-8 * b.norm());
}

// Far from where it was made a hierarchy is given up, be it in the midst of a solve.
TEST(Multigrid, FollowsPointsThatMove) {
  for (const double far : {0.3, 30.0}) {
    Cloud cloud = make_cloud({.points_per_side = 40, .jitter = 0.2, .periodic = true});
    const double dx = cloud.spacing();
    std::optional<LinearSolver> solver;
    for (int step = 0; step < 6; ++step) {
      const System system("laplacian-mixed-soc", cloud, 1e4);
      const Eigen::VectorXd b = system.right_hand_sides(1);
      Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
      if (solver)
        solver->update(system.matrix, system.points);
      else
        solver.emplace(
            system.matrix,
            SolverOptions{.method = Method::Multigrid, .tolerance = 1e-8, .max_iterations = 100},
            system.points);
      const int iterations = solver->solve(b, x).iterations;
      EXPECT_LE(iterations, solve(system.matrix, system.points, b).iterations + 4) << far << step;
      EXPECT_LT((system.matrix * x - b).norm(), 1.01e-8 * b.norm());
      Positions moved = cloud.positions();
      for (int i = 0; i < cloud.size(); ++i)
        moved(i, 0) += far * dx * std::sin(6 * moved(i, 1) + step);
      cloud.move_to(moved);
    }
  }
}

// By a little each time, to what has nothing to do with the medium that the levels were made for.
TEST(Multigrid, FollowsAMediumThatDrifts) {
  const Cloud cloud = make_cloud({.points_per_side = 50, .jitter = 0.2});
  const Operator psi = assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, 0.06));
  std::optional<LinearSolver> solver;
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(cloud.size(), -1, 1);
  for (int step = 0; step < 20; ++step) {
    DenseVector conductivity = DenseVector::Ones(cloud.size());
    for (int i = 0; i < cloud.size(); ++i)
      if (cloud.positions()(i, 0) > 0.5) conductivity[i] = std::pow(1.4, step);
    SparseMatrix A = -with_conductivity(psi, conductivity, Mean::Harmonic).matrix();
    for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1e-2;
    if (solver)
      solver->refactor(A);
    else
      solver.emplace(A, SolverOptions{.method = Method::Multigrid, .tolerance = 1e-8},
                     SystemPoints{cloud});
    Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
    EXPECT_LE(solver->solve(b, x).iterations, 1.5 * solve(A, {cloud}, b).iterations + 2) << step;
  }
}

TEST(Solver, IsUpdatedToAnyMatrix) {
  const System first("laplacian-mixed-zoc"), other("laplacian-mixed-soc", 2, 15);
  for (const Method method : {Method::Auto, Method::Lu, Method::Krylov, Method::Multigrid}) {
    LinearSolver solver(first.matrix, {.method = method}, first.points);
    solver.update(other.matrix, other.points);
    const Eigen::VectorXd b = other.right_hand_sides(1);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size()), y = x;
    solver.solve(b, x);
    LinearSolver(other.matrix, {.method = method}, other.points).solve(b, y);
    EXPECT_EQ(x, y) << name(method);
    EXPECT_THAT(message_of<InvalidInput>([&] { solver.update(first.matrix, other.points); }),
                HasSubstr("there are 225 points for 144 rows"));
    EXPECT_THROW(solver.solve(b, y), SolverError);
    solver.update(other.matrix, other.points);
    solver.solve(b, y);
    EXPECT_LT((x - y).norm(), 1e-9 * x.norm());
  }
}

TEST(Multigrid, NamesRowsThatNothingSmooths) {
  System system("laplacian-mixed-soc",
                make_cloud({.points_per_side = 60, .jitter = 0.2, .periodic = true}), 1e3);
  for (int i = 7; i < system.matrix.rows(); i += 10) system.matrix.coeffRef(i, i) *= -1;
  EXPECT_THAT(message_of<SolverError>([&] {
                LinearSolver(system.matrix, {.method = Method::Multigrid}, system.points);
              }),
              testing::AllOf(HasSubstr("the diagonals of 360 of 3600 rows are weak"),
                             HasSubstr("those of point 7, point 17, point 27, ..")));
}

TEST(Multigrid, TellsHowIterationsConverge) {
  const System system("laplacian-mixed-zoc", make_cloud({.points_per_side = 30}), 1e3);
  const Eigen::VectorXd b = system.right_hand_sides(1);
  std::vector<double> residuals;
  LinearSolver solver(system.matrix,
                      {.method = Method::Multigrid,
                       .progress =
                           [&](int iteration, double residual) {
                             EXPECT_EQ(iteration, std::ssize(residuals) + 1);
                             residuals.push_back(residual);
                           }},
                      system.points);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  const SolveReport report = solver.solve(b, x);
  EXPECT_EQ(std::ssize(residuals), report.iterations);
  EXPECT_LT(residuals.back(), 1e-12);
  EXPECT_GT(residuals.front(), 1e-6);
}

TEST(Multigrid, NeedsPointsWithVolumesThatAreTheirs) {
  const System system("laplacian-mixed-zoc");
  EXPECT_THAT(
      message_of<InvalidInput>([&] { LinearSolver(system.matrix, {.method = Method::Multigrid}); }),
      HasSubstr("multigrid needs the points of the unknowns, with their volumes"));
  const Cloud& cloud = system.cloud;
  const Positions same = Positions::Zero(cloud.size(), 2);
  EXPECT_THAT(message_of<SolverError>([&] {
                LinearSolver(system.matrix, {.method = Method::Multigrid},
                             {Cloud(same, {.volumes = cloud.volumes()})});
              }),
              HasSubstr("coincide"));
}

}  // namespace
}  // namespace gradpsi
