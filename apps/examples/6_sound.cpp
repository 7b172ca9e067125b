// Sound in a square of scattered points with free edges: dp/dt = -div v, dv/dt = -grad p. With the companion of
// the divergence's gradient as grad, momentum is conserved to rounding, energy as well as steps of RK4 can.
#include <cstdio>
#include <gradpsi/gradpsi.hpp>

using gradpsi::VectorOperator;
using State = Eigen::MatrixXd;  // n x 3: the pressure, and the velocity's components

int main() {
  const gradpsi::Cloud cloud =
      gradpsi::make_cloud({.dimension = 2, .points_per_side = 40, .jitter = 0.2});
  const gradpsi::Operator gradient =
      gradpsi::assemble("gradient-ls-2", cloud, gradpsi::find_neighbours(cloud, 0.075));
  const auto companion = gradpsi::conservative_companion(gradient);

  const auto rate = [&](const State& s) {
    Eigen::MatrixXd divergence, force;
    gradpsi::multiply(VectorOperator::Divergence, gradient.axes, s.rightCols(2), divergence);
    gradpsi::multiply(companion, s.col(0), force);
    State result(s.rows(), 3);
    result << -divergence, -force;
    return result;
  };
  const auto momentum = [&](const State& s) -> Eigen::VectorXd {
    return s.rightCols(2).transpose() * gradient.volumes;
  };
  const auto energy = [&](const State& s) {
    return gradient.volumes.dot(s.rowwise().squaredNorm()) / 2;
  };

  for (const int steps : {1000, 2000, 4000}) {
    const double dt = 4.0 / steps;
    State start = State::Zero(cloud.size(), 3);
    start.col(0) = (-50 * (cloud.positions().array() - 0.3).square().rowwise().sum()).exp();
    start.col(1) = start.col(0);  // a pulse that moves along x
    State s = start;
    for (int n = 0; n < steps; ++n) {
      const State a = rate(s), b = rate(s + dt / 2 * a), c = rate(s + dt / 2 * b),
                  d = rate(s + dt * c);
      s += dt / 6 * (a + 2 * b + 2 * c + d);
    }
    std::printf("%d steps: momentum changes by %.0e, energy by %.1e of it\n", steps,
                (momentum(s) - momentum(start)).norm(), 1 - energy(s) / energy(start));
  }
}
