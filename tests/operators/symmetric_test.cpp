// Operators that are symmetric although supports differ.

#include <cmath>

#include "clouds.hpp"
#include "dense.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

std::vector<Scheme> uncorrected() {
  std::vector<Scheme> all;
  for (const Scheme& scheme : schemes())
    if (symmetry(scheme) != Symmetry::None && degree(scheme) == 0 &&
        scheme.derivative != Derivative::Hessian)
      all.push_back(scheme);
  return all;
}

class Symmetric : public testing::TestWithParam<SchemeAndDimension> {};
INSTANTIATE_TEST_SUITE_P(AllSchemes, Symmetric,
                         testing::Combine(testing::ValuesIn(uncorrected()),
                                          testing::Values(1, 2, 3)),
                         case_name);

TEST_P(Symmetric, PairsHaveTheMeanOfWhatEitherSupportMakesOfThem) {
  const auto& [scheme, dimension] = GetParam();
  const Cloud cloud = irregular_cloud(dimension, std::array{30, 7, 4}[dimension - 1]);
  const Eigen::VectorXd h = uneven_supports(cloud);
  const Operator found =
      with_symmetric_supports(scheme, assemble(scheme, cloud, find_neighbours(cloud, h)));
  const int n = cloud.size();
  std::vector<Operator> alike;  // with the support of each point for all
  for (int i = 0; i < n; ++i)
    alike.push_back(assemble(scheme, cloud, find_neighbours(cloud, h[i])));
  for (std::size_t axis = 0; axis < found.axes.size(); ++axis) {
    const Eigen::MatrixXd A = found.axes[axis];
    const double size = A.cwiseAbs().maxCoeff();
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(A.row(i).sum(), 0, 1e-13 * size);
      for (int j = 0; j < n; ++j) {
        if (i == j) continue;
        const double expected =
            (alike[i].axes[axis].coeff(i, j) + alike[j].axes[axis].coeff(i, j)) / 2;
        EXPECT_NEAR(A(i, j), expected, 1e-13 * size) << i << ", " << j;
      }
    }
  }
}

TEST_P(Symmetric, OneSupportIsLeftAsItIs) {
  const auto& [scheme, dimension] = GetParam();
  const Cloud cloud = irregular_cloud(dimension, 5);
  const Operator own =
      assemble(scheme, cloud, find_neighbours(cloud, rich_support(cloud)), {.threads = 2});
  const Operator found = with_symmetric_supports(scheme, own, 2);
  EXPECT_EQ(found.rows.neighbours, own.rows.neighbours);
  for (std::size_t axis = 0; axis < found.axes.size(); ++axis)
    EXPECT_LE((found.axes[axis] - own.axes[axis]).norm(), 1e-14 * own.axes[axis].norm());
}

/// Spacings from 0.025 to 0.25.
Cloud graded() { return read_cloud(GRADPSI_REFERENCE_DIR "/../cases/graded_10_to_1.csv"); }

TEST(Symmetric, LaplaciansOfGradedPointsAreSymmetricAndNegative) {
  const Cloud cloud = graded();
  const Neighbours near = find_neighbours(cloud, 3 * local_spacing(cloud));
  ASSERT_EQ(near.supports.size(), cloud.size());
  for (const Scheme& scheme : uncorrected()) {
    if (order(scheme.derivative) == 1) continue;
    const Operator own = assemble(scheme, cloud, near);
    const Operator found = with_symmetric_supports(scheme, own);
    EXPECT_FALSE(summarise(own.matrix(), own.volumes).symmetric) << name(scheme);
    EXPECT_TRUE(summarise(found.matrix(), found.volumes).symmetric) << name(scheme);
    if (scheme.weight == Weight::Direct) continue;  // never definite
    const Eigen::MatrixXd scaled = found.volumes.asDiagonal() * Eigen::MatrixXd(found.matrix());
    const Eigen::VectorXd values = dense_eigenvalues(scaled);
    EXPECT_LE(values.maxCoeff(), 1e-12 * values.cwiseAbs().maxCoeff()) << name(scheme);
  }
}

TEST(Symmetric, StepsOnGradedPointsAreSolvedByCholesky) {
  const Cloud cloud = graded();
  const Neighbours near = find_neighbours(cloud, 3 * local_spacing(cloud));
  const Operator own = assemble("laplacian-mixed-zoc", cloud, near);
  const Operator found = with_symmetric_supports("laplacian-mixed-zoc", own);
  const auto method = [&](const Operator& op) {
    return ImplicitDiffusion(cloud, op, {}, {.time_step = 0.01}).solver().method;
  };
  EXPECT_EQ(method(own), Method::Lu);
  EXPECT_EQ(method(found), Method::Cholesky);
}

/// The unit square with `side` points along each axis, spacings growing tenfold along both, and the
/// root mean square error of lap sin(3x) cos(2y) inside, for supports of that many spacings.
std::array<double, 2> errors_of_own_and_symmetric(int side, double ratio) {
  const Cloud lattice = make_cloud(Lattice{.points_per_side = side});
  const double a = std::log(10.0);
  const Eigen::ArrayXXd growth = (a * lattice.positions().array()).exp();
  const Eigen::VectorXd volumes = (growth * (a / 9 / side)).rowwise().prod();
  const Cloud cloud(Positions((growth - 1) / 9), {.volumes = volumes});
  const Eigen::VectorXd h = ratio * volumes.cwiseSqrt();
  const Eigen::ArrayXd u =
      (3 * cloud.positions().col(0).array()).sin() * (2 * cloud.positions().col(1).array()).cos();
  const Eigen::ArrayXd inside =
      ((lattice.positions().array() - 0.5).abs() < 0.3).rowwise().all().cast<double>();
  const Operator own = assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, h));
  const Operator both = with_symmetric_supports("laplacian-mixed-zoc", own);
  const auto error = [&](const Operator& op) {
    const Eigen::ArrayXd off = (op.matrix() * u.matrix()).array() + 13 * u;
    return std::sqrt((inside * off.square()).sum() / inside.sum());
  };
  return {error(own), error(both)};
}

TEST(Symmetric, ConvergesAsOwnSupportsDo) {
  // Supports that shrink like sqrt(dx), so that the sums become integrals: order 2 in h.
  const auto [own_coarse, both_coarse] = errors_of_own_and_symmetric(30, 4);
  const auto [own_fine, both_fine] = errors_of_own_and_symmetric(120, 8);
  EXPECT_LT(both_coarse, own_coarse);
  EXPECT_LT(both_fine, 1.5 * own_fine);
  EXPECT_GT(std::log2(both_coarse / both_fine), 1.8);
}

TEST(Symmetric, RowsWithoutAnAnswerStayZeroAndOthersKeepTheirWeights) {
  const Cloud cloud = irregular_cloud(2, 6);
  Eigen::VectorXd h = Eigen::VectorXd::Constant(cloud.size(), rich_support(cloud));
  h[5] = 1e-3;  // alone in its own support, but in those of others
  const Operator own = assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, h),
                                {.on_degenerate = OnDegenerate::Zero});
  const Operator found = with_symmetric_supports("laplacian-mixed-zoc", own);
  EXPECT_EQ(found.rows.outcome[5], RowOutcome::Zero);
  EXPECT_EQ(found.matrix().row(5).norm(), 0);
  EXPECT_GT(own.matrix().col(5).norm(), 0);
  EXPECT_NEAR((found.matrix() - own.matrix()).norm(), 0, 1e-13 * own.matrix().norm());
}

TEST(Symmetric, WhatHasNoSymmetryIsRefused) {
  const Cloud cloud = irregular_cloud(2, 6);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const auto refusal = [&](const Scheme& scheme, const Operator& op) {
    return message_of<InvalidInput>([&] { with_symmetric_supports(scheme, op); });
  };
  const Operator corrected = assemble("laplacian-mixed-soc", cloud, near);
  EXPECT_THAT(refusal("laplacian-mixed-soc", corrected), HasSubstr("is not symmetric"));
  const Operator gradient = assemble("gradient-direct-zoc", cloud, near);
  EXPECT_THAT(refusal("laplacian-mixed-zoc", gradient), HasSubstr("of 2 matrices is none of"));
  const Operator some =
      assemble("laplacian-mixed-zoc", cloud, near, {.rows = std::vector<int>{1, 2}});
  EXPECT_THAT(refusal("laplacian-mixed-zoc", some), HasSubstr("rows of all 36 points, not 2"));
}

}  // namespace
}  // namespace gradpsi
