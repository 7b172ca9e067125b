#include "operators/moments.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "operators/inverse.hpp"

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

/// The inverse by the vector code's elimination, with doubles for lanes; false: singular.
template <bool definite, int M>
bool invert_in_place(Eigen::Matrix<double, M, M>& A) {
  return definite ? invert_definite<M>(A) : invert_general<M>(A);
}

TYPED_TEST(Invert, GivesTheInverseAndTheExactConditionNumber) {
  constexpr int M = TypeParam::value;
  using Matrix = Eigen::Matrix<double, M, M>;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Matrix general = random_matrix<M>(seed);
    const Matrix definite = general * general.transpose();
    for (const bool is_definite : {false, true}) {
      const Matrix A = is_definite ? definite : general;
      const Matrix expected = A.fullPivLu().inverse();
      const double condition = one_norm(A) * one_norm(expected);
      const double tolerance = 1e-14 * condition;
      const Inverse result = is_definite ? invert_definite(A) : invert_general(A);
      EXPECT_NEAR(result.reciprocal_condition * condition, 1, tolerance);
      EXPECT_LT(one_norm(result.matrix - expected), tolerance * one_norm(expected));
      Matrix in_lanes = A;
      EXPECT_TRUE(is_definite ? invert_in_place<true>(in_lanes) : invert_in_place<false>(in_lanes));
      EXPECT_LT(one_norm(in_lanes - expected), tolerance * one_norm(expected));
    }
  }
}

TYPED_TEST(Invert, FindsPivotsOffTheDiagonal) {
  constexpr int M = TypeParam::value;
  Eigen::Matrix<double, M, M> reversal =
      Eigen::Matrix<double, M, M>::Identity().rowwise().reverse();
  EXPECT_EQ(invert_general(reversal).matrix, reversal);
  EXPECT_EQ(invert_general(reversal).reciprocal_condition, 1);
  const Eigen::Matrix<double, M, M> expected = reversal;
  EXPECT_TRUE(invert_in_place<false>(reversal));
  EXPECT_EQ(reversal, expected);
}

TYPED_TEST(Invert, SingularMatricesHaveNoCondition) {
  constexpr int M = TypeParam::value;
  Eigen::Matrix<double, M, M> A = random_matrix<M>(3);
  A.col(M - 1) = 0 * A.col(0);
  EXPECT_EQ(invert_general(A).reciprocal_condition, 0);
  const Eigen::Matrix<double, M, M> semidefinite = A.transpose() * A;
  EXPECT_EQ(invert_definite(semidefinite).reciprocal_condition, 0);
  Eigen::Matrix<double, M, M> in_lanes = A;
  EXPECT_FALSE(invert_in_place<false>(in_lanes));
  in_lanes = semidefinite;
  EXPECT_FALSE(invert_in_place<true>(in_lanes));
  A.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(invert_general(A).reciprocal_condition, 0);
  EXPECT_EQ(invert_definite(A).reciprocal_condition, 0);
}

}  // namespace
}  // namespace gradpsi
