// Ten lines that use every third-party library behind gradpsi, and catch what it throws.
#include <gradpsi/gradpsi.hpp>
#include <iostream>

int main() {
  const gradpsi::Cloud cloud = gradpsi::make_cloud({.points_per_side = 12, .jitter = 0.2});
  const gradpsi::Neighbours near = gradpsi::find_neighbours(cloud, 3 * cloud.spacing());
  const auto laplacian = gradpsi::assemble("laplacian-mixed-zoc", cloud, near);
  Eigen::VectorXd u = cloud.positions().col(0);
  gradpsi::ImplicitDiffusion(cloud, laplacian, {}, {.time_step = 0.01}).step(u);
  std::cout << "grows " << gradpsi::spectrum(laplacian.matrix()).grows() << ", mean " << u.mean()
            << '\n';
  try {
    gradpsi::assemble("laplacian-mixed-socks", cloud, near);
  } catch (const gradpsi::InvalidInput& error) {
    std::cout << error.what() << '\n';
  }
}
