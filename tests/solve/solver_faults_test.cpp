// What solvers must refuse, or say.

#include <thread>

#include "matrix/checks.hpp"
#include "solve/systems.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

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

/// The points of rows whose diagonal entry is not positive.
std::vector<int> not_positive(const SparseMatrix& A) {
  std::vector<int> rows;
  for (int i = 0; i < A.rows(); ++i)
    if (A.coeff(i, i) <= 0) rows.push_back(i);
  return rows;
}

TEST(Fault44, RowsThatLetFieldsGrowAreNamedAtOnce) {
  const System system("laplacian-direct-soc", 2, 40, 100);
  const std::vector<int> rows = not_positive(system.matrix);
  ASSERT_GT(rows.size(), 3U);
  ASSERT_LT(rows.size(), system.matrix.rows() / 2U);
  // Without volumes there is no multigrid, which can correct such rows.
  const SystemPoints points{Cloud(system.cloud.positions())};
  LinearSolver solver(system.matrix, {.method = Method::Krylov}, points);
  EXPECT_EQ(
      solver.report().caution,
      "of " + std::to_string(rows.size()) +
          " rows the diagonal entry has not the sign of most, as where a field grows: point " +
          std::to_string(rows[0]) + ", point " + std::to_string(rows[1]) + ", point " +
          std::to_string(rows[2]) + ", ..");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  const std::string said = message_of<SolverError>([&] { solver.solve(b, x); });
  EXPECT_THAT(said, HasSubstr("after 1000 iterations"));
  EXPECT_THAT(said, HasSubstr(solver.report().caution));
  EXPECT_TRUE(x.isZero(0));
  for (const Method other : {Method::Lu, Method::Multigrid}) {
    LinearSolver able(system.matrix, {.method = other}, system.points);
    EXPECT_EQ(able.report().caution, "");
    able.solve(b, x);
  }
}

TEST(Fault44, FewSuchRowsAreSolvedAndOthersNotSuspected) {
  System system("laplacian-mixed-zoc");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  const auto caution = [&](const SparseMatrix& A) {
    LinearSolver solver(A, {.method = Method::Krylov}, {Cloud(system.cloud.positions())});
    Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
    solver.solve(b, x);
    EXPECT_LE((x - dense_solution(A, b)).norm(), 1e-9 * x.norm());
    return solver.report().caution;
  };
  EXPECT_EQ(caution(system.matrix), "");
  EXPECT_EQ(caution(-system.matrix), "");
  system.matrix.row(70) *= -1;
  const std::string text =
      "of 1 row the diagonal entry has not the sign of most, as where a field grows: point 70";
  EXPECT_EQ(caution(system.matrix), text);
  EXPECT_EQ(caution(-system.matrix), text);
}

TEST(Fault44, LuIsTakenAtOnceWhereTheChoiceIsFree) {
  System system("laplacian-mixed-zoc", 2, 50, 1);
  system.matrix.row(70) *= 2;  // not symmetric
  EXPECT_EQ(LinearSolver(system.matrix, {}, system.points).report().method, Method::Krylov);
  system.matrix.row(70) *= -1;
  EXPECT_EQ(LinearSolver(system.matrix, {}, system.points).report().method, Method::Lu);
}

}  // namespace
}  // namespace gradpsi
