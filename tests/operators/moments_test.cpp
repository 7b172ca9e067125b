#include "operators/moments.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace gradpsi {
namespace {

template <int M>
Eigen::Matrix<double, M, M> random_matrix(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  return Eigen::Matrix<double, M, M>::NullaryExpr([&] { return normal(generator); });
}

template <class Size>
class Invert : public testing::Test {};
using Sizes = testing::Types<std::integral_constant<int, 1>, std::integral_constant<int, 2>,
                             std::integral_constant<int, 5>, std::integral_constant<int, 9>>;
TYPED_TEST_SUITE(Invert, Sizes);

TYPED_TEST(Invert, GivesTheInverseAndTheExactConditionNumber) {
  constexpr int M = TypeParam::value;
  using Matrix = Eigen::Matrix<double, M, M>;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Matrix general = random_matrix<M>(seed);
    const Matrix definite = general * general.transpose();
    for (const bool is_definite : {false, true}) {
      const Matrix A = is_definite ? definite : general;
      const Inverse<M> result = is_definite ? invert<true>(A) : invert<false>(A);
      const Matrix expected = A.fullPivLu().inverse();
      const double condition = one_norm<M>(A) * one_norm<M>(expected);
      EXPECT_NEAR(result.reciprocal_condition * condition, 1, 1e-14 * condition);
      EXPECT_LT(one_norm<M>(Matrix(result.matrix - expected)),
                1e-14 * condition * one_norm<M>(expected));
    }
  }
}

TYPED_TEST(Invert, FindsPivotsOffTheDiagonal) {
  constexpr int M = TypeParam::value;
  const Eigen::Matrix<double, M, M> reversal =
      Eigen::Matrix<double, M, M>::Identity().rowwise().reverse();
  EXPECT_EQ(invert<false>(reversal).matrix, reversal);
  EXPECT_EQ(invert<false>(reversal).reciprocal_condition, 1);
}

TYPED_TEST(Invert, SingularMatricesHaveNoCondition) {
  constexpr int M = TypeParam::value;
  Eigen::Matrix<double, M, M> A = random_matrix<M>(3);
  A.col(M - 1) = 0 * A.col(0);
  EXPECT_EQ(invert<false>(A).reciprocal_condition, 0);
  const Eigen::Matrix<double, M, M> semidefinite = A.transpose() * A;
  EXPECT_EQ(invert<true>(semidefinite).reciprocal_condition, 0);
  A.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(invert<false>(A).reciprocal_condition, 0);
  EXPECT_EQ(invert<true>(A).reciprocal_condition, 0);
}

}  // namespace
}  // namespace gradpsi
