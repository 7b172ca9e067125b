// Linear solvers: every method against a dense solve, and what they must refuse.

#include <Eigen/Dense>
#include <limits>
#include <numeric>
#include <thread>

#include "clouds.hpp"
#include "matrix/checks.hpp"
#include "solve/ordering.hpp"
#include "solve/twin.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// I - c Psi on an irregular cloud, c in spacings squared.
struct System {
  explicit System(const Scheme& scheme, int dimension = 2, int side = 12, double c = 5)
      : System(scheme, irregular_cloud(dimension, side), c) {}
  System(const Scheme& scheme, Cloud points_of, double c) : cloud(std::move(points_of)) {
    const Neighbours near = find_neighbours(cloud, rich_support(cloud));
    const Operator op = assemble(scheme, cloud, near);
    SparseMatrix identity(cloud.size(), cloud.size());
    identity.setIdentity();
    matrix = identity - c * std::pow(cloud.spacing(), 2) * op.matrix();
    matrix.makeCompressed();
    points = {cloud};
  }
  Eigen::MatrixXd right_hand_sides(int count) const {
    std::mt19937_64 generator(7);
    std::uniform_real_distribution<double> value(-1, 1);
    return Eigen::MatrixXd::NullaryExpr(matrix.rows(), count, [&] { return value(generator); });
  }
  Eigen::MatrixXd dense_solution(const Eigen::MatrixXd& b) const {
    return Eigen::MatrixXd(matrix).fullPivLu().solve(b);
  }

  Cloud cloud;
  SparseMatrix matrix;
  SystemPoints points;
};

SparseMatrix sparse(const Eigen::MatrixXd& dense) {
  SparseMatrix matrix = dense.sparseView();
  matrix.makeCompressed();
  return matrix;
}

struct Case {
  Method method;
  std::string scheme;
  int dimension;
  double stiffness;
};

class Methods : public testing::TestWithParam<Case> {};

TEST_P(Methods, AgreeWithADenseSolve) {
  const auto& [method, scheme, dimension, stiffness] = GetParam();
  const System system(scheme, dimension, dimension == 3 ? 7 : 14, stiffness);
  const Eigen::MatrixXd b = system.right_hand_sides(3);
  const Eigen::MatrixXd exact = system.dense_solution(b);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
  LinearSolver solver(system.matrix, {.method = method}, system.points);
  const SolveReport report = solver.solve(b, x);
  EXPECT_EQ(solver.report().method, method);
  // The residual is at most 1e-10, the matrices' condition numbers below 1e5.
  EXPECT_LT((x - exact).norm(), 1e-7 * exact.norm());
  double residual = 0;
  for (int c = 0; c < b.cols(); ++c)
    residual = std::max(residual, (b.col(c) - system.matrix * x.col(c)).norm() / b.col(c).norm());
  // Some rows at the edge are 1e5 times the others; that is what rounding leaves of their terms.
  EXPECT_LE(report.residual, 1e-10);
  EXPECT_NEAR(report.residual, residual, 1e-11);
}

std::string case_of(const testing::TestParamInfo<Case>& info) {
  const Case& c = info.param;
  return identifier(std::string(name(c.method)) + "_" + c.scheme) + "_" +
         std::to_string(c.dimension) + "d_" + std::to_string(static_cast<int>(c.stiffness));
}

INSTANTIATE_TEST_SUITE_P(Solver, Methods,
                         testing::Values(Case{Method::Cholesky, "laplacian-mixed-zoc", 1, 5},
                                         Case{Method::Cholesky, "laplacian-diffuse-zoc", 2, 5},
                                         Case{Method::Cholesky, "laplacian-mixed-zoc", 3, 500},
                                         Case{Method::Lu, "laplacian-mixed-soc", 1, 5},
                                         Case{Method::Lu, "laplacian-mixed-soc", 2, 5},
                                         Case{Method::Lu, "laplacian-direct-zoc", 3, 5},
                                         Case{Method::Krylov, "laplacian-mixed-zoc", 2, 5},
                                         Case{Method::Krylov, "laplacian-mixed-zoc", 2, 5000},
                                         Case{Method::Krylov, "laplacian-diffuse-ns-zoc", 3, 5},
                                         Case{Method::Krylov, "laplacian-mixed-soc", 1, 5},
                                         Case{Method::Krylov, "laplacian-mixed-soc", 2, 1},
                                         Case{Method::Krylov, "laplacian-mixed-soc", 3, 1}),
                         case_of);

TEST(Solver, WithoutPointsWorksOnAnyMatrix) {
  const Eigen::MatrixXd dense{{4, -1, 0}, {-2, 5, 1}, {0, 1, 3}};
  const Eigen::VectorXd b{{1, 2, 3}};
  for (const Method m : {Method::Auto, Method::Lu, Method::Krylov}) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(3);
    LinearSolver(sparse(dense), {.method = m}).solve(b, x);
    EXPECT_LT((dense * x - b).norm(), 1e-12);
  }
}

TEST(Solver, AutoTakesCholeskyForSymmetricPositiveDefiniteMatricesOnly) {
  const auto chosen = [](const std::string& scheme) {
    const System system(scheme);
    const SolverReport report = LinearSolver(system.matrix, {}, system.points).report();
    EXPECT_NE(report.reason, "");
    EXPECT_EQ(report.unknowns, 144);
    EXPECT_GT(report.factor.entries, 144);
    return report.method;
  };
  EXPECT_EQ(chosen("laplacian-mixed-zoc"), Method::Cholesky);
  EXPECT_EQ(chosen("laplacian-mixed-soc"), Method::Lu);
}

TEST(Solver, OrderingsGiveTheSameSolution) {
  const System system("laplacian-mixed-zoc", 2, 30);
  const Eigen::VectorXd b = system.right_hand_sides(1);
  const Eigen::VectorXd exact = system.dense_solution(b);
  for (const Ordering ordering : {Ordering::Coordinates, Ordering::Amd, Ordering::Metis})
    for (const Method m : {Method::Cholesky, Method::Lu}) {
      Eigen::VectorXd x = b;
      LinearSolver(system.matrix, {.method = m, .ordering = ordering}, system.points).solve(b, x);
      EXPECT_LT((x - exact).norm(), 1e-11 * exact.norm()) << name(ordering) << name(m);
    }
}

TEST(Solver, RefactorEqualsAFreshSolver) {
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"})
    for (const Method m : {Method::Auto, Method::Krylov}) {
      const System one(scheme, 2, 12, 1), other(scheme, 2, 12, 300);
      const Eigen::VectorXd b = one.right_hand_sides(1);
      Eigen::VectorXd refactored = b, fresh = b;
      LinearSolver solver(one.matrix, {.method = m}, one.points);
      solver.refactor(other.matrix);
      solver.solve(b, refactored);
      LinearSolver(other.matrix, {.method = m}, other.points).solve(b, fresh);
      EXPECT_EQ(refactored, fresh) << scheme << name(m);
    }
}

TEST(Solver, RefactorFollowsTheMatrixToAnotherMethod) {
  const Eigen::VectorXd b{{1, 2}};
  const Eigen::MatrixXd definite{{2, 1}, {1, 2}}, unsymmetric{{2, 1}, {-1, 3}},
      indefinite{{1, 2}, {2, 1}};
  LinearSolver solver(sparse(definite));
  const auto error_of = [&](const Eigen::MatrixXd& dense) {
    Eigen::VectorXd x = b;
    solver.solve(b, x);
    return (dense * x - b).norm();
  };
  for (const auto& [dense, expected] :
       {std::pair(definite, Method::Cholesky), std::pair(unsymmetric, Method::Lu),
        std::pair(definite, Method::Cholesky), std::pair(indefinite, Method::Lu)}) {
    solver.refactor(sparse(dense));
    EXPECT_EQ(solver.report().method, expected);
    EXPECT_LT(error_of(dense), 1e-14);
  }
}

TEST(Solver, AFailedRefactorLeavesNothingToSolveWith) {
  const Eigen::VectorXd b{{1, 2}};
  Eigen::VectorXd x = b;
  LinearSolver solver(sparse(Eigen::MatrixXd{{2, 1}, {1, 2}}), {.method = Method::Cholesky});
  EXPECT_THROW(solver.refactor(sparse(Eigen::MatrixXd{{1, 2}, {2, 1}})), SolverError);
  EXPECT_THAT(message_of<SolverError>([&] { solver.solve(b, x); }), HasSubstr("no factor"));
  solver.refactor(sparse(Eigen::MatrixXd{{4, 1}, {1, 2}}));
  LinearSolver moved = std::move(solver);
  moved.solve(b, x);
  EXPECT_LT((Eigen::MatrixXd{{4, 1}, {1, 2}} * x - b).norm(), 1e-14);
}

TEST(Solver, RefactorRefusesAnotherPattern) {
  LinearSolver solver(sparse(Eigen::MatrixXd{{2, 1}, {1, 2}}));
  EXPECT_THAT(message_of<InvalidInput>([&] {
                solver.refactor(sparse(Eigen::MatrixXd{{2, 0}, {1, 2}}));
              }),
              HasSubstr("pattern"));
}

TEST(Fault11, KrylovDoesNotDependOnThreads) {
  for (const std::string scheme : {"laplacian-mixed-soc", "laplacian-mixed-zoc"}) {
    const System system(scheme, periodic(irregular_cloud(2, 75)), 1);
    const Eigen::VectorXd b = system.right_hand_sides(1);
    const auto solution = [&](int threads) {
      Eigen::VectorXd x = b;
      LinearSolver(system.matrix, {.method = Method::Krylov, .tolerance = 1e-6, .threads = threads},
                   system.points)
          .solve(b, x);
      return x;
    };
    EXPECT_EQ(solution(1), solution(2));
  }
}

TEST(Solver, AGoodStartNeedsNoIteration) {
  const System system("laplacian-mixed-soc");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = system.dense_solution(b);
  LinearSolver solver(system.matrix, {.method = Method::Krylov, .tolerance = 1e-9}, system.points);
  EXPECT_EQ(solver.solve(b, x).iterations, 0);
}

TEST(Fault01, ASolverOfNothingHasNothingToSolve) {
  LinearSolver solver{SparseMatrix(0, 0)};
  Eigen::VectorXd nothing(0);
  EXPECT_EQ(solver.solve(nothing, nothing).residual, 0);
}

TEST(Fault20, AFactorBeyondTheMemoryIsRefusedOrAvoided) {
  if (!GRADPSI_WITH_CHOLMOD) GTEST_SKIP() << "Eigen cannot tell beforehand";
  const System system("laplacian-mixed-zoc", 2, 30);
  for (const Method m : {Method::Cholesky, Method::Lu})
    EXPECT_THAT(message_of<SolverError>([&] {
                  LinearSolver(system.matrix, {.method = m, .memory = 1e5}, system.points);
                }),
                testing::AllOf(HasSubstr("of the 0.0001 GB given"), HasSubstr("krylov")));
  LinearSolver solver(system.matrix, {.memory = 1e5}, system.points);
  EXPECT_EQ(solver.report().method, Method::Krylov);
  EXPECT_THAT(solver.report().reason, HasSubstr("0.0001 GB given"));
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = b;
  EXPECT_LE(solver.solve(b, x).residual, 1e-12);
}

TEST(Fault21, OneMatrixServesManyThreads) {
  const System system("laplacian-mixed-zoc", 2, 20);
  const Eigen::VectorXd b = system.right_hand_sides(1);
  std::vector<Eigen::VectorXd> x(4, b);
  std::vector<std::thread> threads;
  for (auto& mine : x)
    threads.emplace_back([&] {
      LinearSolver solver(system.matrix, {.threads = 1}, system.points);
      for (int k = 0; k < 5; ++k) solver.solve(b, mine);
    });
  for (auto& thread : threads) thread.join();
  const Eigen::VectorXd exact = system.dense_solution(b);
  for (const auto& mine : x) EXPECT_LT((mine - exact).norm(), 1e-11 * exact.norm());
}

TEST(Fault22, CholeskyRefusesAnUnsymmetricMatrix) {
  const System system("laplacian-mixed-soc");
  EXPECT_THAT(message_of<InvalidInput>([&] {
                LinearSolver(system.matrix, {.method = Method::Cholesky}, system.points);
              }),
              HasSubstr("not: use lu or krylov"));
}

TEST(Fault22, SymmetryIsSeenEntryByEntry) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(3);
  const Eigen::MatrixXd symmetric{{4, 1, 2}, {1, 4, 0}, {2, 0, 4}};
  EXPECT_TRUE(is_symmetric(sparse(symmetric), ones));
  EXPECT_FALSE(is_symmetric(sparse(symmetric), Eigen::VectorXd{{1, 2, 1}}));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (i == j) continue;
      Eigen::MatrixXd other = symmetric;
      other(i, j) += 0.5;
      EXPECT_FALSE(is_symmetric(sparse(other), ones)) << i << j;
      other(i, j) = 0;
      EXPECT_EQ(is_symmetric(sparse(other), ones), symmetric(i, j) == 0) << i << j;
    }
  // diag(1, 2, 3) times this is symmetric.
  EXPECT_TRUE(is_symmetric(sparse(Eigen::MatrixXd{{4, 6, 3}, {3, 4, 0}, {1, 0, 4}}),
                           Eigen::VectorXd{{1, 2, 3}}));
}

TEST(Fault23, AnIndefiniteMatrixIsNamed) {
  const Eigen::MatrixXd indefinite{{1, 2, 0}, {2, 1, 0}, {0, 0, 1}};
  EXPECT_THAT(message_of<SolverError>(
                  [&] { LinearSolver(sparse(indefinite), {.method = Method::Cholesky}); }),
              HasSubstr("symmetric but not positive definite: use lu"));
  LinearSolver solver(sparse(indefinite));
  EXPECT_EQ(solver.report().method, Method::Lu);
  EXPECT_THAT(solver.report().reason, HasSubstr("symmetric but not positive definite"));
  const Eigen::VectorXd b{{1, 2, 3}};
  Eigen::VectorXd x = b;
  solver.solve(b, x);
  EXPECT_LT((indefinite * x - b).norm(), 1e-12);
}

TEST(Fault24, WhatIsNotFiniteAndEmptyRowsAreRefused) {
  const auto refused = [](const Eigen::MatrixXd& dense) {
    return message_of<InvalidInput>([&] {
      LinearSolver(sparse(dense), {},
                   {.cloud = Cloud(Positions::Random(2, 2), {.numbers = {10, 11}})});
    });
  };
  for (const double bad : {nan, infinity, -infinity})
    EXPECT_THAT(refused(Eigen::MatrixXd{{1, 0}, {0, bad}}),
                HasSubstr("not finite in the row of point 11"));
  EXPECT_THAT(refused(Eigen::MatrixXd{{0, 0}, {0, 1}}),
              HasSubstr("only zeros in the row of point 10"));
  EXPECT_THAT(refused(Eigen::MatrixXd::Zero(2, 2)), HasSubstr("only zeros in the row of point 10"));

  LinearSolver solver(sparse(Eigen::MatrixXd{{2, 1}, {1, 2}}));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2);
  for (const double bad : {nan, infinity})
    EXPECT_THAT(message_of<InvalidInput>([&] {
                  solver.solve(Eigen::VectorXd{{1, bad}}, x);
                }),
                HasSubstr("not finite at row 1"));
  EXPECT_THAT(message_of<InvalidInput>([&] { solver.solve(Eigen::VectorXd(3), x); }),
              HasSubstr("b is 3 x 1"));
  EXPECT_THAT(message_of<InvalidInput>([] {
                LinearSolver(sparse(Eigen::MatrixXd{{2}}), {}, {.walls = {0, 1}});
              }),
              HasSubstr("wall row 1 is not one of 1"));
}

TEST(Fault24, AllZerosOnTheRightHaveASolution) {
  for (const Method m : {Method::Cholesky, Method::Lu, Method::Krylov}) {
    Eigen::VectorXd x = Eigen::VectorXd::Ones(2);
    LinearSolver solver(sparse(Eigen::MatrixXd{{2, 1}, {1, 2}}), {.method = m});
    EXPECT_EQ(solver.solve(Eigen::VectorXd::Zero(2), x).residual, 0);
    EXPECT_EQ(x, Eigen::VectorXd::Zero(2));
  }
}

TEST(Solver, RightHandSidesOfAnySizeAreSolvedAlike) {
  const System system("laplacian-mixed-soc");
  const Eigen::VectorXd b = system.right_hand_sides(1), zero = Eigen::VectorXd::Zero(b.size());
  for (const Method m : {Method::Lu, Method::Krylov}) {
    LinearSolver solver(system.matrix, {.method = m}, system.points);
    Eigen::VectorXd x = zero;
    solver.solve(b, x);
    for (const double unit : {0x1p-900, 0x1p900}) {
      Eigen::VectorXd scaled = zero;
      const SolveReport report = solver.solve(unit * b, scaled);
      EXPECT_EQ(scaled, unit * x) << unit << name(m);
      EXPECT_GT(report.residual, 0);
    }
  }
}

TEST(Fault25, ConstantsInTheNullSpaceAreNamed) {
  // Rows 0 and 2 are a pure Neumann problem of their own.
  const Eigen::MatrixXd dense{{1, 0, -1}, {0, 3, 0}, {-2, 0, 2}};
  for (const Method m : {Method::Auto, Method::Lu, Method::Krylov})
    EXPECT_THAT(message_of<SolverError>([&] { LinearSolver(sparse(dense), {.method = m}); }),
                testing::AllOf(HasSubstr("singular: the 2 rows connected with that of row 0"),
                               HasSubstr("any constant")));
  EXPECT_EQ(floating_rows(sparse(Eigen::MatrixXd{{1, 0, -1}, {0, 3, 0}, {-2, 0, 2.1}})).count, 0);
}

TEST(Fault25, ASingularMatrixOfAnotherKindIsAnErrorToo) {
  const Eigen::MatrixXd dense{{1, 1, 0}, {1, 1, 0}, {1, 2, 3}};
  for (const Method m : {Method::Auto, Method::Lu, Method::Krylov})
    EXPECT_THROW(
        {
          Eigen::VectorXd x = Eigen::VectorXd::Zero(3);
          LinearSolver(sparse(dense), {.method = m}).solve(Eigen::VectorXd{{1, 2, 3}}, x);
        },
        SolverError);
}

TEST(Fault26, NoConvergenceIsAnErrorWithTheResidualReached) {
  const System system("laplacian-mixed-soc", 2, 12, 50);
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = b;
  LinearSolver solver(system.matrix, {.method = Method::Krylov, .max_iterations = 2},
                      system.points);
  try {
    solver.solve(b, x);
    FAIL() << "converged";
  } catch (const SolverError& error) {
    EXPECT_GT(error.residual, 1e-12);
    EXPECT_THAT(error.what(), HasSubstr("after 2 iterations"));
  }
  EXPECT_EQ(x, b);
}

TEST(Solver, LuTakesOverWhereAutoDoesNotConverge) {
  // One-sided rows at the edge of the cloud, some of them 1e5 times too large.
  const System system("laplacian-mixed-soc", 2, 50, 0.5);
  LinearSolver solver(system.matrix, {}, system.points);
  ASSERT_EQ(solver.report().method, Method::Krylov);
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = b;
  solver.solve(b, x);
  EXPECT_EQ(solver.report().method, Method::Lu);
  EXPECT_THAT(solver.report().reason, HasSubstr("iterations did not converge"));
  EXPECT_LT((system.matrix * x - b).norm(), 1e-8 * b.norm());
}

TEST(Solver, RefusesOptionsOutOfRange) {
  const auto refused = [](const SolverOptions& options) {
    return message_of<InvalidInput>([&] {
      LinearSolver(sparse(Eigen::MatrixXd{{2, 1}, {1, 2}}), options);
    });
  };
  EXPECT_THAT(refused({.tolerance = 0}), HasSubstr("tolerance"));
  EXPECT_THAT(refused({.tolerance = nan}), HasSubstr("tolerance"));
  EXPECT_THAT(refused({.max_iterations = 0}), HasSubstr("max_iterations"));
  EXPECT_THAT(refused({.memory = -1}), HasSubstr("memory"));
  EXPECT_THAT(refused({.threads = -1}), HasSubstr("threads"));
  EXPECT_THAT(message_of<InvalidInput>([] { LinearSolver(SparseMatrix(2, 3)); }),
              HasSubstr("square"));
  EXPECT_THAT(message_of<InvalidInput>([] { method("cholski"); }), HasSubstr("valid: cholesky"));
  for (const Method m : {Method::Auto, Method::Cholesky, Method::Lu, Method::Krylov})
    EXPECT_EQ(method(name(m)), m);
}

TEST(Dissection, IsAPermutationWithLittleFill) {
  for (const int dimension : {1, 2, 3}) {
    const System system("laplacian-mixed-zoc", dimension, dimension == 3 ? 12 : 40);
    Eigen::VectorXi order = dissection(system.cloud.positions(), system.matrix);
    std::sort(order.begin(), order.end());
    for (int k = 0; k < order.size(); ++k) ASSERT_EQ(order[k], k);
    const auto entries = [&](Ordering ordering) {
      return LinearSolver(system.matrix, {.ordering = ordering}, system.points)
          .report()
          .factor.entries;
    };
    EXPECT_LT(entries(Ordering::Coordinates), 1.4 * entries(Ordering::Amd)) << dimension;
  }
}

TEST(Twin, ActsOnSmoothFieldsAsTheMatrixDoes) {
  // A periodic cloud, so that no row is truncated; there A u = u - c lap u.
  const Cloud cloud = periodic(irregular_cloud(2, 40));
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const double c = 3e-4;
  SparseMatrix A = -c * assemble("laplacian-mixed-soc", cloud, near).matrix();
  for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1;
  std::vector<int> rows(cloud.size());
  std::iota(rows.begin(), rows.end(), 0);
  const Eigen::VectorXd m = row_diffusivities(A, cloud, rows, 0);
  EXPECT_LT((m.array() / c - 1).abs().maxCoeff(), 1e-10);
  SparseMatrix twin;
  compact_twin(A, cloud, rows, twin_scales(A, cloud, rows, {}, 0), 0, twin);
  const SparseMatrix upper = (cloud.volumes().asDiagonal() * twin).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd S = Eigen::MatrixXd(upper).selfadjointView<Eigen::Upper>();
  EXPECT_LT(2 * upper.nonZeros(), A.nonZeros());
  EXPECT_EQ(Eigen::MatrixXd(S).llt().info(), Eigen::Success);
  // Row sums, and the energy of a smooth field: u^T S u = integral u^2 + c |grad u|^2.
  EXPECT_LT((S.rowwise().sum() - cloud.volumes()).cwiseAbs().maxCoeff(), 1e-15);
  const Eigen::VectorXd u = (2 * M_PI * cloud.positions().col(0).array()).cos();
  const double exact = u.dot(cloud.volumes().cwiseProduct(u)) + c * 2 * M_PI * M_PI;
  EXPECT_NEAR(u.dot(S * u), exact, 0.03 * exact);
}

}  // namespace
}  // namespace gradpsi
