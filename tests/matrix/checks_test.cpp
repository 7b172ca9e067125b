#include "matrix/checks.hpp"

#include "clouds.hpp"

namespace gradpsi {
namespace {

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

}  // namespace
}  // namespace gradpsi
