#include "solve/twin.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>

#include "clouds.hpp"
#include "multigrid/medium.hpp"

namespace gradpsi {
namespace {

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
