#include "operators/moments.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "dense.hpp"

namespace gradpsi {
namespace {

Eigen::MatrixXd random_matrix(int size, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(generator); });
}

double norm(const Eigen::MatrixXd& A) { return A.cwiseAbs().colwise().sum().maxCoeff(); }

template <class Size>
class Invert : public testing::Test {
 protected:
  struct Result {
    Eigen::MatrixXd matrix;
    double reciprocal_condition;
  };
  static constexpr int M = Size::value;
  static Result definite(const Eigen::MatrixXd& A) {
    const Inverse<M> result = invert<true, M>(Eigen::Matrix<double, M, M>(A));
    return {result.matrix, result.reciprocal_condition};
  }
  static Result general(const Eigen::MatrixXd& A) {
    const Inverse<M> result = invert<false, M>(Eigen::Matrix<double, M, M>(A));
    return {result.matrix, result.reciprocal_condition};
  }
};
using Sizes = testing::Types<std::integral_constant<int, 1>, std::integral_constant<int, 2>,
                             std::integral_constant<int, 5>, std::integral_constant<int, 9>>;
TYPED_TEST_SUITE(Invert, Sizes);

TYPED_TEST(Invert, GivesTheInverseAndTheExactConditionNumber) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Eigen::MatrixXd general = random_matrix(this->M, seed);
    const Eigen::MatrixXd definite = dense_product(general, general.transpose());
    for (const bool is_definite : {false, true}) {
      const Eigen::MatrixXd& A = is_definite ? definite : general;
      const auto result = is_definite ? this->definite(A) : this->general(A);
      const Eigen::MatrixXd expected = dense_inverse(A);
      const double condition = norm(A) * norm(expected);
      EXPECT_NEAR(result.reciprocal_condition * condition, 1, 1e-14 * condition);
      EXPECT_LT(norm(result.matrix - expected), 1e-14 * condition * norm(expected));
    }
  }
}

TYPED_TEST(Invert, FindsPivotsOffTheDiagonal) {
  const Eigen::MatrixXd reversal = Eigen::MatrixXd::Identity(this->M, this->M).rowwise().reverse();
  EXPECT_EQ(this->general(reversal).matrix, reversal);
  EXPECT_EQ(this->general(reversal).reciprocal_condition, 1);
}

TYPED_TEST(Invert, SingularMatricesHaveNoCondition) {
  Eigen::MatrixXd A = random_matrix(this->M, 3);
  A.col(this->M - 1).setZero();
  EXPECT_EQ(this->general(A).reciprocal_condition, 0);
  EXPECT_EQ(this->definite(dense_product(A.transpose(), A)).reciprocal_condition, 0);
  A.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(this->general(A).reciprocal_condition, 0);
  EXPECT_EQ(this->definite(A).reciprocal_condition, 0);
}

}  // namespace
}  // namespace gradpsi
