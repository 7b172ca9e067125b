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

}  // namespace
}  // namespace gradpsi
