// A Laplacian and implicit steps: heat flows through three letters from their hot ends to the cold ones.
#include <gradpsi/gradpsi.hpp>
#include <iostream>

int main() {
  const gradpsi::Cloud cloud = gradpsi::read_cloud("apps/data/letters.csv");
  const gradpsi::Neighbours near = gradpsi::find_neighbours(cloud, 3 * cloud.spacing());
  const gradpsi::Operator laplacian = gradpsi::assemble("laplacian-mixed-zoc", cloud, near);

  const auto x = cloud.positions().col(0).array();
  Eigen::VectorXd u = (x <= 2.101).cast<double>();  // one end at 1, the other at 0
  gradpsi::FixedValues ends;
  for (int i = 0; i < cloud.size(); ++i)
    if (x[i] <= 2.101 || x[i] >= 2.449) ends.points.push_back(i);

  gradpsi::ImplicitDiffusion heat(cloud, laplacian, {.fixed = ends}, {.time_step = 0.01});
  for (int n = 0; n < 200; ++n) heat.step(u);  // factorised once
  std::cout << heat.solver().description << ", mean temperature " << u.mean() << '\n';
}
