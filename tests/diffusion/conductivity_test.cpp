#include "diffusion/scene.hpp"

namespace gradpsi {
namespace {

TEST(Conductivity, ArithmeticMeanIsTheProductRule) {
  for (const int dimension : {1, 2, 3}) {
    const Scene scene("laplacian-diffuse-soc", dimension, dimension == 1 ? 30 : 7);
    const Eigen::VectorXd kappa = 1 + scene.cloud.positions().rowwise().sum().array();
    const Eigen::VectorXd u = scene.field();
    const SparseMatrix& psi = scene.laplacian.matrix();
    const Eigen::VectorXd rule = 0.5 * (psi * kappa.cwiseProduct(u) + kappa.cwiseProduct(psi * u) -
                                        u.cwiseProduct(psi * kappa));
    const Eigen::VectorXd flux = with_conductivity(scene.laplacian, kappa).matrix() * u;
    EXPECT_LT((flux - rule).norm(),
              1e-12 * (psi.cwiseAbs() * u.cwiseAbs()).norm() * kappa.maxCoeff());
    // div((1 + x + ..) grad x) = 1, exact where quadratics are.
    const Eigen::VectorXd ones = with_conductivity(scene.laplacian, kappa).matrix() * scene.x();
    EXPECT_LT((ones.array() - 1).abs().maxCoeff(), 1e-7);
  }
}

TEST(Conductivity, KeepsSymmetryAndRowSums) {
  const Scene scene("laplacian-mixed-zoc");
  const Eigen::VectorXd kappa = scene.field().array().exp();
  for (const Mean mean : {Mean::Arithmetic, Mean::Harmonic}) {
    const Operator flux = with_conductivity(scene.laplacian, kappa, mean);
    const Eigen::MatrixXd S = Eigen::MatrixXd(scene.cloud.volumes().asDiagonal() * flux.matrix());
    EXPECT_LT((S - S.transpose()).cwiseAbs().maxCoeff(), 1e-14 * S.cwiseAbs().maxCoeff());
    EXPECT_LT(S.rowwise().sum().cwiseAbs().maxCoeff(), 1e-14 * S.cwiseAbs().maxCoeff());
  }
}

// kappa lap u + grad kappa . grad u, exact where the Laplacian and the gradient are.
TEST(Conductivity, ProductRuleNeedsTheGradient) {
  for (const int dimension : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(dimension, dimension == 1 ? 30 : 7);
    const auto op = assemble({"laplacian-ls-2", "gradient-ls-2"}, cloud,
                             find_neighbours(cloud, rich_support(cloud)));
    const Eigen::ArrayXd x = cloud.positions().col(0), sum = cloud.positions().rowwise().sum();
    const Eigen::VectorXd kappa = 1 + sum.square(), u = x.square();
    const Eigen::VectorXd found = with_conductivity(op[0], op[1], kappa).matrix() * u;
    EXPECT_LT((found.array() - 2 * kappa.array() - 4 * sum * x).abs().maxCoeff(), 1e-8);
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(cloud.size());
    EXPECT_LT((with_conductivity(op[0], op[1], ones).matrix() - op[0].matrix()).norm(),
              1e-12 * op[0].matrix().norm());
  }
}

/// Root mean square errors of both forms, of div(kappa grad u) for generic fields, away from the edges.
std::array<double, 2> errors_of_both_forms(int side) {
  const Cloud cloud = make_cloud(Lattice{.points_per_side = side, .jitter = 0.2});
  const auto op = assemble({"laplacian-ls-2", "gradient-ls-2"}, cloud,
                           find_neighbours(cloud, 3.5 * cloud.spacing()));
  const Eigen::ArrayXd x = cloud.positions().col(0), y = cloud.positions().col(1);
  const Eigen::ArrayXd u = (3 * x).sin() * (2 * y + 0.3).cos(), kappa = 1.5 + (2 * x + y).sin();
  const Eigen::ArrayXd exact = -13 * kappa * u +
                               2 * (2 * x + y).cos() * 3 * (3 * x).cos() * (2 * y + 0.3).cos() -
                               (2 * x + y).cos() * 2 * (3 * x).sin() * (2 * y + 0.3).sin();
  const Eigen::ArrayXd inside =
      ((cloud.positions().array() - 0.5).abs() < 0.3).rowwise().all().cast<double>();
  const auto error = [&](const Operator& flux) {
    const Eigen::ArrayXd off = (flux.matrix() * u.matrix()).array() - exact;
    return std::sqrt((inside * off.square()).sum() / inside.sum());
  };
  return {error(with_conductivity(op[0], kappa)), error(with_conductivity(op[0], op[1], kappa))};
}

TEST(Conductivity, BothFormsConverge) {
  const auto [mean_coarse, rule_coarse] = errors_of_both_forms(30);
  const auto [mean_fine, rule_fine] = errors_of_both_forms(120);
  EXPECT_GT(std::log2(mean_coarse / mean_fine) / 2, 0.9);
  EXPECT_GT(std::log2(rule_coarse / rule_fine) / 2, 0.9);
}

TEST(Conductivity, TheGradientMustBeOfTheSamePoints) {
  const Scene scene("laplacian-mixed-soc");
  const Operator gradient = assemble("gradient-ls-1", scene.cloud,
                                     find_neighbours(scene.cloud, scene.cloud.spacing() * 2));
  EXPECT_THAT(message_of<InvalidInput>([&] {
                with_conductivity(scene.laplacian, gradient,
                                  Eigen::VectorXd::Ones(scene.cloud.size()));
              }),
              testing::HasSubstr("do not share their rows and pattern"));
}

}  // namespace
}  // namespace gradpsi
