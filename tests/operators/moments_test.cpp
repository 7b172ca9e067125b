#include "operators/moments.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <random>

#include "dense.hpp"
#include "operators/inverse.hpp"

namespace gradpsi {
namespace {

Eigen::MatrixXd random_matrix(int size, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(generator); });
}

double norm(const Eigen::MatrixXd& A) { return A.cwiseAbs().colwise().sum().maxCoeff(); }

template <int M>
struct Array {
  double a[M][M];
  double& operator()(int i, int j) { return a[i][j]; }
  double operator()(int i, int j) const { return a[i][j]; }
};

/// The inverse by the vector code's elimination, with doubles for lanes; nothing if singular.
template <int M>
std::optional<Eigen::MatrixXd> inverse_in_lanes(bool definite, const Eigen::MatrixXd& A) {
  Array<M> lanes;
  for (int i = 0; i < M; ++i)
    for (int j = 0; j < M; ++j) lanes(i, j) = A(i, j);
  if (!(definite ? invert_definite<M>(lanes) : invert_general<M>(lanes))) return {};
  return Eigen::MatrixXd::NullaryExpr(M, M, [&](Eigen::Index i, Eigen::Index j) {
    return lanes(static_cast<int>(i), static_cast<int>(j));
  });
}

template <class Size>
class Invert : public testing::Test {
 protected:
  static constexpr int M = Size::value;
  static Inverse inverse(bool definite, const Eigen::MatrixXd& A) {
    return definite ? invert_definite(A) : invert_general(A);
  }
};
using Sizes = testing::Types<std::integral_constant<int, 1>, std::integral_constant<int, 2>,
                             std::integral_constant<int, 5>, std::integral_constant<int, 9>>;
TYPED_TEST_SUITE(Invert, Sizes);

TYPED_TEST(Invert, GivesTheInverseAndTheExactConditionNumber) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Eigen::MatrixXd general = random_matrix(this->M, seed);
    for (const bool definite : {false, true}) {
      const Eigen::MatrixXd A = definite ? dense_product(general, general.transpose()) : general;
      const Eigen::MatrixXd expected = dense_inverse(A);
      const double condition = norm(A) * norm(expected), tolerance = 1e-14 * condition;
      const Inverse result = this->inverse(definite, A);
      EXPECT_NEAR(result.reciprocal_condition * condition, 1, tolerance);
      EXPECT_LT(norm(result.matrix - expected), tolerance * norm(expected));
      const auto in_lanes = inverse_in_lanes<TypeParam::value>(definite, A);
      ASSERT_TRUE(in_lanes);
      EXPECT_LT(norm(*in_lanes - expected), tolerance * norm(expected));
    }
  }
}

TYPED_TEST(Invert, FindsPivotsOffTheDiagonal) {
  const Eigen::MatrixXd reversal = Eigen::MatrixXd::Identity(this->M, this->M).rowwise().reverse();
  EXPECT_EQ(invert_general(reversal).matrix, reversal);
  EXPECT_EQ(invert_general(reversal).reciprocal_condition, 1);
  EXPECT_EQ(inverse_in_lanes<TypeParam::value>(false, reversal), reversal);
}

TYPED_TEST(Invert, SingularMatricesHaveNoCondition) {
  Eigen::MatrixXd A = random_matrix(this->M, 3);
  A.col(this->M - 1).setZero();
  const Eigen::MatrixXd semidefinite = dense_product(A.transpose(), A);
  EXPECT_EQ(invert_general(A).reciprocal_condition, 0);
  EXPECT_EQ(invert_definite(semidefinite).reciprocal_condition, 0);
  EXPECT_FALSE(inverse_in_lanes<TypeParam::value>(false, A));
  EXPECT_FALSE(inverse_in_lanes<TypeParam::value>(true, semidefinite));
  A.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(invert_general(A).reciprocal_condition, 0);
  EXPECT_EQ(invert_definite(A).reciprocal_condition, 0);
}

}  // namespace
}  // namespace gradpsi
