// The gradient that conserves momentum, of any gradient.

#include "clouds.hpp"
#include "dense.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

std::vector<Scheme> gradients() {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (scheme.derivative == Derivative::Gradient && degree(scheme) >= 0 && degree(scheme) <= 3)
      chosen.push_back(scheme);
  return chosen;
}

class Companion : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  int dimension() const { return std::get<1>(GetParam()); }
  /// Unequal volumes, and supports that differ from point to point.
  Operator gradient() const {
    const auto& [scheme, d] = GetParam();
    const Cloud cloud = irregular_cloud(d, d == 1 ? 40 : d == 2 ? 12 : 7);
    const double ratio = support_ratio(scheme).value_or(2.5) + 0.5;
    const Eigen::VectorXd h =
        Eigen::VectorXd::LinSpaced(cloud.size(), 0.93, 1) * ratio * cloud.spacing();
    return assemble(scheme, cloud, find_neighbours(cloud, h));
  }
};

/// sum omega a b, and what its rounding is measured by.
double dot(const Eigen::VectorXd& omega, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (omega.asDiagonal() * a.cwiseProduct(b)).sum();
}

TEST_P(Companion, IsTheNegativeAdjointOfTheDivergence) {
  const Operator G = gradient();
  const std::vector<SparseMatrix> companion = conservative_companion(G);
  ASSERT_EQ(std::ssize(companion), dimension());
  const Eigen::Index n = G.volumes.size();
  const Eigen::MatrixXd v = Eigen::MatrixXd::Random(n, dimension());
  const Eigen::VectorXd p = Eigen::VectorXd::Random(n);
  Eigen::MatrixXd force, divergence;
  multiply(companion, p, force);
  multiply(VectorOperator::Divergence, G.axes, v, divergence);
  double size = 0;
  for (const SparseMatrix& A : companion)
    size += dot(G.volumes, Eigen::VectorXd::Ones(n), A.cwiseAbs() * p.cwiseAbs());
  EXPECT_LT(std::abs(dot(G.volumes, v, force) + dot(G.volumes, divergence, p)), 1e-14 * size);
  EXPECT_GT(std::abs(dot(G.volumes, v, force)), 1e-6 * size);
}

TEST_P(Companion, ConservesMomentum) {
  const Operator G = gradient();
  const Eigen::VectorXd p = Eigen::VectorXd::Random(G.volumes.size());
  for (const SparseMatrix& A : conservative_companion(G)) {
    const double size = G.volumes.dot(A.cwiseAbs() * p.cwiseAbs());
    EXPECT_LT(std::abs(G.volumes.dot(A * p)), 1e-14 * size);
  }
}

TEST_P(Companion, MakesASymmetricNegativeLaplacian) {
  const Operator G = gradient();
  const auto companion = conservative_companion(G);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(G.volumes.size(), G.volumes.size());
  for (int a = 0; a < dimension(); ++a)
    S += Eigen::MatrixXd(G.volumes.asDiagonal() * G.axes[a]) * Eigen::MatrixXd(companion[a]);
  const double size = S.cwiseAbs().maxCoeff();
  EXPECT_LT((S - S.transpose()).cwiseAbs().maxCoeff(), 1e-12 * size);
  const Eigen::VectorXd values = dense_eigenvalues(S);
  EXPECT_LT(values.maxCoeff(), 1e-12 * values.cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(Gradients, Companion,
                         testing::Combine(testing::ValuesIn(gradients()), testing::Values(1, 2, 3)),
                         case_name);

// sum_j omega_j (u_j + u_i) grad W: the sign of u_i is all that differs from the antisymmetric sum.
TEST(Companions, OfTheUncorrectedGradientIsTheSymmetricSum) {
  const Cloud cloud = irregular_cloud(2, 10);
  const Operator G =
      assemble("gradient-direct-zoc", cloud, find_neighbours(cloud, rich_support(cloud)));
  const auto companion = conservative_companion(G);
  for (const int a : {0, 1}) {
    const Eigen::MatrixXd minus = G.axes[a], plus = companion[a];
    const Eigen::MatrixXd expected = minus - 2 * Eigen::MatrixXd(minus.diagonal().asDiagonal());
    EXPECT_LT((plus - expected).norm(), 1e-14 * minus.norm());
  }
}

TEST(Companions, ArgumentsThatDoNotFitAreRefused) {
  const Cloud cloud = irregular_cloud(2, 6);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator some =
      assemble("gradient-direct-foc", cloud, near, {.rows = std::vector<int>{2, 1}});
  EXPECT_THAT(message_of<InvalidInput>([&] { conservative_companion(some); }),
              HasSubstr("needs the rows of all 36 points, not 2"));
  EXPECT_THROW(conservative_companion(Operator{}), InvalidInput);
  Operator differing = assemble("gradient-direct-foc", cloud, near);
  differing.axes[1].prune([](int, int column, double) { return column != 5; });
  EXPECT_THAT(message_of<InvalidInput>([&] { conservative_companion(differing); }),
              HasSubstr("do not share"));
}

}  // namespace
}  // namespace gradpsi
