// A gradient in ten lines.
#include <gradpsi/gradpsi.hpp>
#include <iostream>

int main() {
  const gradpsi::Cloud cloud = gradpsi::read_cloud("apps/data/letters.csv");  // 3,993 points in 3D
  const gradpsi::Neighbours near = gradpsi::find_neighbours(cloud, 3 * cloud.spacing());
  const gradpsi::Operator gradient = gradpsi::assemble("gradient-direct-soc", cloud, near);

  const Eigen::VectorXd u = cloud.positions().rowwise().squaredNorm();  // x^2 + y^2 + z^2
  const Eigen::VectorXd u_x = gradient.axes[0] * u;
  const Eigen::VectorXd error = u_x - 2 * cloud.positions().col(0);
  std::cout << "du/dx is 2 x to within " << error.cwiseAbs().maxCoeff() << '\n';
}
