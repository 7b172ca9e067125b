// A kernel of your own, (1 - q^2)^4: its shape, two derivatives, and what makes its integral 1.
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <numbers>

gradpsi::Profile profile(double q) {
  const double s = 1 - q * q;
  return {
      .w = s * s * s * s, .dw_over_q = -8 * s * s * s, .d2w = -8 * s * s * s + 48 * q * q * s * s};
}

int main() {
  constexpr double pi = std::numbers::pi;
  const gradpsi::Kernel bell{.name = "bell",
                             .formula = "(1 - q^2)^4",
                             .profile = profile,
                             .normalisation = {315 / 256.0, 5 / pi, 3465 / (512 * pi)}};
  const gradpsi::Cloud cloud =
      gradpsi::make_cloud({.dimension = 2, .points_per_side = 60, .jitter = 0.2});
  const gradpsi::Neighbours near = gradpsi::find_neighbours(cloud, 3 * cloud.spacing());
  const Eigen::ArrayXd x = cloud.positions().col(0), y = cloud.positions().col(1);
  const Eigen::VectorXd u = sin(3 * x) * cos(2 * y);

  for (const gradpsi::Kernel& kernel : {gradpsi::kernel("wendland-c2"), bell}) {
    const gradpsi::Operator laplacian =
        gradpsi::assemble("laplacian-mixed-soc-ls", cloud, near, {.kernel = kernel});
    const Eigen::VectorXd error = laplacian.matrix() * u + 13 * u;
    std::cout << kernel.name << ": rms error of the Laplacian " << error.norm() / (13 * u).norm()
              << '\n';
  }
}
