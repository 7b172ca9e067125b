// Systems whose solutions are determined up to a constant.

#include "solve/systems.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

/// A steady problem that nothing holds: -Psi in a periodic box.
struct Floating {
  explicit Floating(const std::string& scheme)
      : cloud(make_cloud({.points_per_side = 20, .jitter = 0.2, .periodic = true})),
        matrix(-assemble(scheme, cloud, find_neighbours(cloud, 3 * cloud.spacing())).matrix()) {
    matrix.makeCompressed();
  }
  double mean(const Eigen::VectorXd& u) const {
    return cloud.volumes().dot(u) / cloud.volumes().sum();
  }
  Cloud cloud;
  SparseMatrix matrix;
};

TEST(Mean, MakesSolutionsUniqueByAnyMethod) {
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Floating floating(scheme);
    Eigen::MatrixXd b(400, 2);
    b.col(0) = Eigen::VectorXd::LinSpaced(400, -1, 2);
    b.col(1) = floating.cloud.positions().col(0);
    for (const Method method :
         {Method::Auto, Method::Cholesky, Method::Lu, Method::Krylov, Method::Multigrid}) {
      if (method == Method::Cholesky && scheme != "laplacian-mixed-zoc") continue;
      LinearSolver solver(floating.matrix, {.method = method, .tolerance = 1e-10, .mean = 3},
                          {floating.cloud});
      Eigen::MatrixXd x = Eigen::MatrixXd::Zero(400, 2);
      const SolveReport report = solver.solve(b, x);
      double removed = 0;
      for (int c = 0; c < 2; ++c) {
        EXPECT_NEAR(floating.mean(x.col(c)), 3, 1e-9);
        const Eigen::VectorXd left = b.col(c) - floating.matrix * x.col(c);
        EXPECT_LT(left.maxCoeff() - left.minCoeff(), 1e-7) << scheme << name(method);
        removed = std::max(removed, std::abs(left.mean()));
      }
      EXPECT_NEAR(report.removed, removed, 1e-7);
      EXPECT_LE(report.residual, 1e-9);
      EXPECT_LE(report.iterations, method == Method::Multigrid ? 60 : 1'000);
    }
  }
}

TEST(Mean, IsNotLookedAtWhereSolutionsAreUnique) {
  const System system("laplacian-mixed-soc");
  const Eigen::VectorXd b = system.right_hand_sides(1);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size()), y = x;
  LinearSolver(system.matrix, {.mean = 7}, system.points).solve(b, x);
  LinearSolver(system.matrix, {}, system.points).solve(b, y);
  EXPECT_EQ(x, y);
}

TEST(Mean, IsAskedOfSystemsInOnePiece) {
  // Two pieces have a constant each.
  const Eigen::MatrixXd dense{{1, -1, 0, 0}, {-1, 1, 0, 0}, {0, 0, 2, -2}, {0, 0, -2, 2}};
  EXPECT_THAT(message_of<SolverError>([&] { LinearSolver(sparse(dense), {.mean = 0}); }),
              HasSubstr("the 2 rows connected with that of row 0 sum to zero"));
  EXPECT_THAT(message_of<InvalidInput>([&] { LinearSolver(sparse(dense), {.mean = nan}); }),
              HasSubstr("mean must be finite"));
}

TEST(Mean, CanBeGivenUpByOtherValues) {
  const Floating floating("laplacian-mixed-zoc");
  SparseMatrix regular = floating.matrix;
  for (int i = 0; i < 400; ++i) regular.coeffRef(i, i) += 1;
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(400, -1, 2);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(400);
  LinearSolver solver(floating.matrix, {.mean = 0}, {floating.cloud});
  solver.refactor(regular);
  solver.solve(b, x);
  EXPECT_LT((regular * x - b).norm(), 1e-10 * b.norm());
}

}  // namespace
}  // namespace gradpsi
