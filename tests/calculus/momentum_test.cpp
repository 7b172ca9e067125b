// Sound waves in a square of jittered points with free edges: dp/dt = -div v, dv/dt = -grad p. With the conservative
// companion of the divergence's gradient as grad, momentum is conserved to rounding, and energy as well as
// the time integrator can.

#include "clouds.hpp"

namespace gradpsi {
namespace {

/// Pressure, then the velocity's components, a column each.
using State = Eigen::MatrixXd;

class Waves {
 public:
  Waves(const Scheme& scheme, int dimension)
      : cloud_(irregular_cloud(dimension, dimension == 1   ? 60
                                          : dimension == 2 ? 14
                                                           : 7)),
        divergence_(assemble(scheme, cloud_, find_neighbours(cloud_, rich_support(cloud_)))),
        gradient_(conservative_companion(divergence_)) {
    // No frequency is above the root of this bound: that is the scaled norm of div grad.
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(cloud_.size());
    for (int a = 0; a < dimension; ++a)
      sums += divergence_.axes[a].cwiseAbs() *
              (gradient_[a].cwiseAbs() * Eigen::VectorXd::Ones(cloud_.size()));
    shortest_time_ = 1 / std::sqrt(sums.maxCoeff());
  }

  /// The pair that is no pair: the gradient of the divergence itself.
  void use_the_same_gradient_twice() { gradient_ = divergence_.axes; }

  double shortest_time() const { return shortest_time_; }

  State start() const {
    State state(cloud_.size(), 1 + gradient_.size());
    state.col(0) = (3 * cloud_.positions().col(0).array()).sin();
    for (Eigen::Index a = 1; a < state.cols(); ++a)
      state.col(a) = 0.3 * (2 * cloud_.positions().col(a - 1).array() + 1.0 * a).cos();
    return state;
  }

  State slope(const State& state) const {
    State result(state.rows(), state.cols());
    Eigen::MatrixXd part;
    multiply(VectorOperator::Divergence, divergence_.axes, state.rightCols(state.cols() - 1), part);
    result.col(0) = -part;
    multiply(gradient_, state.col(0), part);
    result.rightCols(part.cols()) = -part;
    return result;
  }

  void runge_kutta(State& state, double dt) const {
    const State a = slope(state), b = slope(state + dt / 2 * a), c = slope(state + dt / 2 * b),
                d = slope(state + dt * c);
    state += dt / 6 * (a + 2 * b + 2 * c + d);
  }

  /// Velocities half a step, pressures a step, velocities half a step.
  void leapfrog(State& state, double dt) const {
    const Eigen::Index d = state.cols() - 1;
    state.rightCols(d) += dt / 2 * slope(state).rightCols(d);
    state.col(0) += dt * slope(state).col(0);
    state.rightCols(d) += dt / 2 * slope(state).rightCols(d);
  }

  double energy(const State& state) const {
    return 0.5 * divergence_.volumes.dot(state.rowwise().squaredNorm());
  }
  Eigen::VectorXd momentum(const State& state) const {
    return state.rightCols(state.cols() - 1).transpose() * divergence_.volumes;
  }

 private:
  Cloud cloud_;
  Operator divergence_;
  std::vector<SparseMatrix> gradient_;
  double shortest_time_ = 0;
};

using Stepper = void (Waves::*)(State&, double) const;

/// The largest change of the energy, relative, over a time of that many of the shortest times.
double energy_error(const Waves& waves, Stepper stepper, int times, int steps_a_time) {
  State state = waves.start();
  const double begin = waves.energy(state);
  double worst = 0;
  for (int k = 0; k < times * steps_a_time; ++k) {
    (waves.*stepper)(state, waves.shortest_time() / steps_a_time);
    worst = std::max(worst, std::abs(waves.energy(state) - begin));
  }
  return worst / begin;
}

class Momentum : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  Waves waves() const { return {std::get<0>(GetParam()), std::get<1>(GetParam())}; }
};

TEST_P(Momentum, IsConservedToRoundingOverAThousandSteps) {
  const Waves waves = this->waves();
  for (const Stepper stepper : {&Waves::runge_kutta, &Waves::leapfrog}) {
    State state = waves.start();
    const Eigen::VectorXd begin = waves.momentum(state);
    for (int k = 0; k < 1000; ++k) (waves.*stepper)(state, waves.shortest_time());
    EXPECT_LT((waves.momentum(state) - begin).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_GT(waves.energy(state), 0.01);  // there still are waves
    EXPECT_TRUE(state.allFinite());
  }
}

// A system whose energy is conserved loses (dt frequency)^6/72 of it in a step of RK4; that of the leapfrog
// is conserved up to a term of dt^2 that comes and goes.
TEST_P(Momentum, EnergyIsConservedToTheOrderOfTheSteps) {
  const Waves waves = this->waves();
  const auto order = [&](Stepper stepper) {
    return std::log2(energy_error(waves, stepper, 200, 2) / energy_error(waves, stepper, 200, 4));
  };
  EXPECT_NEAR(order(&Waves::runge_kutta), 5, 0.2);
  EXPECT_NEAR(order(&Waves::leapfrog), 2, 0.2);
}

TEST_P(Momentum, NeitherIsConservedByAGradientThatIsNotTheCompanion) {
  Waves waves = this->waves();
  waves.use_the_same_gradient_twice();
  State state = waves.start();
  const Eigen::VectorXd begin = waves.momentum(state);
  for (int k = 0; k < 100; ++k) waves.runge_kutta(state, waves.shortest_time());
  EXPECT_GT((waves.momentum(state) - begin).cwiseAbs().maxCoeff(), 1e-3);
  const double coarse = energy_error(waves, &Waves::runge_kutta, 100, 2),
               fine = energy_error(waves, &Waves::runge_kutta, 100, 4);
  EXPECT_GT(fine, 0.5 * coarse);
}

INSTANTIATE_TEST_SUITE_P(Schemes, Momentum,
                         testing::Combine(testing::Values(Scheme("gradient-direct-zoc"),
                                                          Scheme("gradient-direct-foc"),
                                                          Scheme("gradient-ls-2")),
                                          testing::Values(1, 2)),
                         case_name);
INSTANTIATE_TEST_SUITE_P(InSpace, Momentum,
                         testing::Combine(testing::Values(Scheme("gradient-ls-2")),
                                          testing::Values(3)),
                         case_name);

}  // namespace
}  // namespace gradpsi
