// Every method against a dense solve; what is solved again.

#include "solve/systems.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

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

TEST(Solver, AGoodStartNeedsNoIteration) {
  const System system("laplacian-mixed-soc");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = system.dense_solution(b);
  LinearSolver solver(system.matrix, {.method = Method::Krylov, .tolerance = 1e-9}, system.points);
  EXPECT_EQ(solver.solve(b, x).iterations, 0);
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

TEST(Solver, LuTakesOverWhereAutoDoesNotConverge) {
  // Each point turned to the next: its eigenvalues are all around zero.
  System system("laplacian-mixed-zoc", 2, 50, 0);
  const Eigen::Index n = system.matrix.rows();
  for (Eigen::Index i = 0; i < n; ++i) system.matrix.coeffRef(i, i) = 0.5;
  for (Eigen::Index i = 0; i < n; ++i) system.matrix.coeffRef(i, (i + 1) % n) += 1;
  system.matrix.makeCompressed();
  LinearSolver solver(system.matrix, {}, system.points);
  ASSERT_EQ(solver.report().method, Method::Krylov);
  EXPECT_EQ(solver.report().caution, "");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = b;
  solver.solve(b, x);
  EXPECT_EQ(solver.report().method, Method::Lu);
  EXPECT_THAT(solver.report().reason, HasSubstr("iterations did not converge"));
  EXPECT_LT((system.matrix * x - b).norm(), 1e-8 * b.norm());
}

}  // namespace
}  // namespace gradpsi
