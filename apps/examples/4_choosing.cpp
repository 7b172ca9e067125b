// Which Laplacian for these points? Each is tried on a wave: how accurate it is, how many entries a row
// it takes, and whether it would let a field grow, the outermost points being held.
#include <cstdio>
#include <gradpsi/gradpsi.hpp>
#include <string>

int main() {
  const gradpsi::Cloud cloud =
      gradpsi::make_cloud({.dimension = 2, .points_per_side = 40, .jitter = 0.3});
  const gradpsi::Neighbours near = gradpsi::find_neighbours(cloud, 3 * cloud.spacing());
  const Eigen::ArrayXd x = cloud.positions().col(0), y = cloud.positions().col(1);
  const Eigen::VectorXd u = sin(6 * x) * sin(6 * y);

  std::vector<int> inside;
  for (int i = 0; i < cloud.size(); ++i)
    if (std::min({x[i], y[i], 1 - x[i], 1 - y[i]}) > 1.0 / 40) inside.push_back(i);

  std::printf("%-28s %12s %14s  %s\n", "", "rms error", "entries a row", "grows");
  for (const gradpsi::Scheme& scheme : gradpsi::schemes()) {
    if (scheme.derivative != gradpsi::Derivative::Laplacian) continue;
    const gradpsi::Operator laplacian =
        gradpsi::assemble(scheme, cloud, near, {.on_degenerate = gradpsi::OnDegenerate::Widen});
    const Eigen::VectorXd error = (laplacian.matrix() * u + 72 * u)(inside);
    const gradpsi::Forecast forecast =
        gradpsi::forecast(cloud, laplacian.matrix(), inside, laplacian.volumes);
    std::printf("%-28s %12.1e %14.1f  %s\n", name(scheme).c_str(),
                error.norm() / (72 * u(inside)).norm(),
                static_cast<double>(laplacian.matrix().nonZeros()) / cloud.size(),
                forecast.grows ? "yes" : "no");
  }
}
