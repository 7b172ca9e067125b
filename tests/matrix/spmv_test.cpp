#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

class Products : public testing::TestWithParam<int> {
 protected:
  int dimension() const { return GetParam(); }
  /// Enough entries for several parts.
  Cloud cloud() const {
    return irregular_cloud(dimension(), dimension() == 1 ? 30'000 : dimension() == 2 ? 90 : 17);
  }
  Neighbours near(const Cloud& cloud) const { return find_neighbours(cloud, rich_support(cloud)); }
};

Eigen::VectorXd random_vector(Eigen::Index n) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  return Eigen::VectorXd::NullaryExpr(n, [&] { return normal(generator); });
}

/// |y - expected| against sum |a| |x|, row by row.
double error(const SparseMatrix& A, const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  const Eigen::VectorXd scale = A.cwiseAbs() * x.cwiseAbs();
  return ((A * x - y).array() / scale.array()).abs().maxCoeff();
}

constexpr double rounding = 20 * 2.2e-16;  // sums of up to 100 terms, in another order

TEST_P(Products, AgreeWithEigen) {
  const Cloud cloud = this->cloud();
  const SparseMatrix A = assemble("laplacian-mixed-soc-ls", cloud, near(cloud)).matrix();
  const Eigen::VectorXd x = random_vector(A.cols());
  Eigen::VectorXd y;
  multiply(A, x, y);
  EXPECT_LT(error(A, x, y), rounding);
  for (const int columns : {1, 3, 4, 5, 9}) {
    Eigen::MatrixXd X(A.cols(), columns), Y;
    for (int c = 0; c < columns; ++c) X.col(c) = x.array() + c;
    multiply(A, X, Y);
    ASSERT_EQ(Y.cols(), columns);
    for (int c = 0; c < columns; ++c) EXPECT_LT(error(A, X.col(c), Y.col(c)), rounding);
  }
  const SingleSparseMatrix single = A.cast<float>();
  multiply(single, x, y);
  EXPECT_LT(error(A, x, y), 6.1e-8);
  EXPECT_LT(error(single.cast<double>(), x, y), rounding);
}

TEST_P(Products, AGradientIsOnePass) {
  const Cloud cloud = this->cloud();
  const Operator gradient = assemble("gradient-direct-soc", cloud, near(cloud));
  const Eigen::VectorXd x = random_vector(cloud.size());
  Eigen::MatrixXd Y;
  multiply(gradient.axes, x, Y);
  ASSERT_EQ(Y.cols(), dimension());
  for (int a = 0; a < dimension(); ++a) EXPECT_LT(error(gradient.axes[a], x, Y.col(a)), rounding);
  std::vector<SparseMatrix> many;  // more than are read together
  for (int a = 0; a < 7; ++a) many.push_back((a + 1) * gradient.axes[a % dimension()]);
  multiply(many, x, Y);
  ASSERT_EQ(Y.cols(), 7);
  for (int a = 0; a < 7; ++a) EXPECT_LT(error(many[a], x, Y.col(a)), rounding);
}

TEST_P(Products, HalfASymmetricMatrixIsEnough) {
  const Cloud uneven = this->cloud();
  const Cloud cloud(uneven.positions(), {.volumes = Eigen::VectorXd::Ones(uneven.size())});
  const SparseMatrix A =
      assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, rich_support(uneven))).matrix();
  const SparseMatrix upper = A.triangularView<Eigen::Upper>();
  const Eigen::VectorXd x = random_vector(A.cols());
  Eigen::VectorXd y;
  multiply_symmetric(upper, x, y);
  EXPECT_LT(error(A, x, y), rounding);
}

TEST_P(Products, DoNotDependOnTheNumberOfThreads) {
  const Cloud cloud = this->cloud();
  const Operator gradient = assemble("gradient-direct-soc", cloud, near(cloud));
  const SparseMatrix upper = gradient.matrix().triangularView<Eigen::Upper>();
  const Eigen::VectorXd x = random_vector(cloud.size());
  Eigen::VectorXd one, many;
  Eigen::MatrixXd one_all, many_all;
  for (const int threads : {2, 5}) {
    multiply(gradient.matrix(), x, one, 1), multiply(gradient.matrix(), x, many, threads);
    EXPECT_EQ(one, many);
    multiply(gradient.axes, x, one_all, 1), multiply(gradient.axes, x, many_all, threads);
    EXPECT_EQ(one_all, many_all);
    multiply_symmetric(upper, x, one, 1), multiply_symmetric(upper, x, many, threads);
    EXPECT_EQ(one, many);
  }
}

INSTANTIATE_TEST_SUITE_P(Dimensions, Products, testing::Values(1, 2, 3),
                         [](const auto& p) { return std::to_string(p.param) + "d"; });

TEST(Product, OfNothingIsNothing) {
  SparseMatrix A(0, 0);
  Eigen::VectorXd y;
  multiply(A, Eigen::VectorXd(), y);
  EXPECT_EQ(y.size(), 0);
  A.resize(3, 2);  // rows without entries
  multiply(A, Eigen::VectorXd::Ones(2), y);
  EXPECT_EQ(y, Eigen::VectorXd::Zero(3));
  multiply_symmetric(SparseMatrix(3, 3), Eigen::VectorXd::Ones(3), y);
  EXPECT_EQ(y, Eigen::VectorXd::Zero(3));
}

TEST(Product, ArgumentsThatDoNotFitAreRefused) {
  SparseMatrix A(3, 3);
  A.setIdentity();
  Eigen::VectorXd x = Eigen::VectorXd::Ones(3), y(3);
  using testing::HasSubstr;
  EXPECT_THAT(message_of<InvalidInput>([&] { multiply(A, Eigen::VectorXd::Ones(4).eval(), y); }),
              HasSubstr("the vector has 4 entries for 3 columns"));
  EXPECT_THAT(message_of<InvalidInput>([&] { multiply(A, x, x); }),
              HasSubstr("written over its argument"));
  EXPECT_THROW(multiply(A, x, y, -1), InvalidInput);
  SparseMatrix lower = A;
  lower.coeffRef(2, 0) = 1;
  EXPECT_THAT(message_of<InvalidInput>([&] { multiply(lower, x, y); }),
              HasSubstr("not compressed"));
  lower.makeCompressed();
  EXPECT_THAT(message_of<InvalidInput>([&] { multiply_symmetric(lower, x, y); }),
              HasSubstr("row 2 has an entry below the diagonal"));
  Eigen::MatrixXd Y;
  EXPECT_THAT(message_of<InvalidInput>([&] {
                multiply(std::array{A, lower}, x, Y);
              }),
              HasSubstr("do not share their pattern"));
  EXPECT_THROW(multiply(std::span<const SparseMatrix>{}, x, Y), InvalidInput);
}

}  // namespace
}  // namespace gradpsi
