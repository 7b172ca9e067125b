// Matrices where some values follow from the others.

#include <algorithm>

#include "clouds.hpp"

namespace gradpsi {
namespace {

// Walls without flux: the values there follow from those inside, and the rest evolves by what is left.
TEST(Eliminate, SaysWhatTheMatrixSaysOfFieldsThatMeetTheConditions) {
  const Cloud cloud = irregular_cloud(2, 10, 5);
  const int n = cloud.size();
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  const SparseMatrix A = assemble("laplacian-mixed-soc-ls", cloud, near).matrix();
  const std::vector<int> walls = {3, 2, 99, 90, 91};
  const Operator slope = assemble("gradient-direct-foc", cloud, near, {.rows = walls});
  const SparseMatrix result = eliminate(A, walls, slope.axes[0]);

  Eigen::VectorXd u =
      (3 * cloud.positions().col(0).array()).sin() + cloud.positions().col(1).array();
  u(walls).setZero();
  const Eigen::VectorXd changes = result * u;
  const Eigen::MatrixXd own = Eigen::MatrixXd(slope.axes[0])(Eigen::all, walls);
  u(walls) = -own.partialPivLu().solve(slope.axes[0] * u);
  EXPECT_NEAR((slope.axes[0] * u).cwiseAbs().maxCoeff(), 0, 1e-12);
  const Eigen::VectorXd expected = A * u;
  for (int i = 0; i < n; ++i) {
    const bool is_wall = std::ranges::find(walls, i) != walls.end();
    EXPECT_NEAR(changes[i], is_wall ? 0 : expected[i], 1e-9) << i;
  }
  for (const int i : walls) EXPECT_EQ(Eigen::MatrixXd(result).col(i).cwiseAbs().maxCoeff(), 0);
}

TEST(Eliminate, RefusesConditionsThatLeaveValuesOpen) {
  const SparseMatrix A = sparse(Eigen::MatrixXd::Identity(5, 5));
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(2, 5);
  EXPECT_THROW(eliminate(A, {0, 1}, sparse(sums)), InvalidInput);
  sums.leftCols(2).setOnes();
  EXPECT_THROW(eliminate(A, {0, 1}, sparse(sums)), SolverError);
  const SparseMatrix conditions = sparse(Eigen::MatrixXd::Identity(1, 5));
  EXPECT_THROW(eliminate(A, {0, 1}, conditions), InvalidInput);
  EXPECT_THROW(eliminate(A, {5}, conditions), InvalidInput);
  EXPECT_EQ(eliminate(A, {0}, conditions).row(0).nonZeros(), 0);
}

}  // namespace
}  // namespace gradpsi
