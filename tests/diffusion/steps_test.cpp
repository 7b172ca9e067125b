// Steps against their literal formula and their order.

#include <cmath>

#include "dense.hpp"
#include "diffusion/scene.hpp"

namespace gradpsi {
namespace {

/// One step by the formula, nothing eliminated: fixed rows are the identity.
Eigen::VectorXd literal_step(const Scene& scene, const BoundaryConditions& conditions,
                             const DiffusionOptions& options, const Eigen::VectorXd& u) {
  const int n = scene.size();
  const Eigen::MatrixXd psi = scene.laplacian.matrix();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  const double dt = options.time_step, nu = options.diffusivity;
  const bool steady = std::isinf(dt);
  Eigen::MatrixXd A = -nu * psi;
  if (!steady) A = identity + dt * options.theta * A;
  Eigen::VectorXd start = u;
  const auto& fixed = conditions.fixed;
  for (std::size_t k = 0; k < fixed.points.size(); ++k)
    if (fixed.values.size() > 0) start[fixed.points[k]] = fixed.values[k];
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  if (!steady) b = start + dt * (1 - options.theta) * nu * psi * start;
  if (options.source.size() > 0) b += (steady ? 1 : dt) * options.source;
  for (const int i : fixed.points) {
    A.row(i) = identity.row(i);
    b[i] = start[i];
  }
  const auto& walls = conditions.walls;
  for (std::size_t k = 0; k < walls.points.size(); ++k) {
    const int i = walls.points[k];
    A.row(i) = walls.transfer[k] * identity.row(i);
    for (int a = 0; a < scene.cloud.dimension(); ++a)
      A.row(i) += walls.normals(k, a) * Eigen::MatrixXd(walls.gradient[a]).row(k);
    b[i] = walls.flux[k];
  }
  return dense_solution(A, b);
}

struct Case {
  std::string name, scheme;
  int dimension;
  double time_step, theta;
  bool with_walls;
};

class EveryCase : public testing::TestWithParam<Case> {};

TEST_P(EveryCase, StepsByTheLiteralFormula) {
  const Case& c = GetParam();
  const Scene scene(c.scheme, c.dimension, c.dimension == 1 ? 60 : c.dimension == 2 ? 12 : 7);
  BoundaryConditions conditions{.fixed = {scene.left}};
  if (c.with_walls) conditions.walls = scene.wall(0.7, 0.3);
  const DiffusionOptions options{
      .diffusivity = 0.6, .time_step = c.time_step, .theta = c.theta, .source = scene.field(5)};
  for (const bool prescribed : {false, true}) {
    if (prescribed) conditions.fixed.values = Eigen::VectorXd::LinSpaced(scene.left.size(), -1, 1);
    ImplicitDiffusion heat(scene.cloud, scene.laplacian, conditions, options);
    Eigen::VectorXd u = scene.field(), literal = u;
    for (int n = 0; n < 2; ++n) {
      const SolveReport report = heat.step(u);
      EXPECT_LE(report.residual, 1e-12);
      literal = literal_step(scene, conditions, options, literal);
    }
    // Residuals up to 1e-12, condition numbers below 1e5.
    EXPECT_LT((u - literal).norm(), 1e-8 * literal.norm()) << heat.solver().description;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Diffusion, EveryCase,
    testing::Values(Case{"symmetric_1d", "laplacian-mixed-zoc", 1, 1e-3, 1, false},
                    Case{"symmetric_2d", "laplacian-mixed-zoc", 2, 1e-2, 1, false},
                    Case{"symmetric_3d", "laplacian-diffuse-zoc", 3, 1e-2, 0.5, false},
                    Case{"symmetric_steady", "laplacian-mixed-zoc", 2, infinity, 1, false},
                    Case{"corrected_2d", "laplacian-mixed-soc", 2, 1e-3, 1, false},
                    Case{"corrected_crank", "laplacian-mixed-soc", 2, 1e-3, 0.5, false},
                    Case{"walls_2d", "laplacian-mixed-soc", 2, 1e-3, 1, true},
                    Case{"walls_3d", "laplacian-mixed-soc", 3, 1e-3, 0.7, true},
                    Case{"walls_symmetric_scheme", "laplacian-mixed-zoc", 2, 1e-3, 0.5, true},
                    Case{"walls_steady", "laplacian-mixed-soc", 2, infinity, 1, true},
                    Case{"indefinite", "laplacian-direct-zoc", 2, 1e-2, 1, false}),
    [](const auto& the_case) { return the_case.param.name; });

TEST(Diffusion, CrankNicolsonIsOfSecondOrderInTimeBackwardEulerOfFirst) {
  const Scene scene("laplacian-mixed-zoc", 1, 40);
  Eigen::VectorXd smooth = (scene.x().array() * 3).sin();
  ImplicitDiffusion smoother(scene.cloud, scene.laplacian, {.fixed = {scene.left}},
                             {.time_step = 0.02});
  for (int n = 0; n < 5; ++n) smoother.step(smooth);
  const auto after = [&](double theta, int steps) {
    ImplicitDiffusion heat(scene.cloud, scene.laplacian, {.fixed = {scene.left}},
                           {.time_step = 0.2 / steps, .theta = theta});
    Eigen::VectorXd u = smooth;
    for (int n = 0; n < steps; ++n) heat.step(u);
    return u;
  };
  const auto order = [&](double theta) {
    const Eigen::VectorXd limit = after(0.5, 2000);
    return std::log2((after(theta, 20) - limit).norm() / (after(theta, 40) - limit).norm());
  };
  EXPECT_NEAR(order(1), 1, 0.1);
  EXPECT_NEAR(order(0.5), 2, 0.1);
}

TEST_P(EveryCase, DampedStepsAreTwoByBackwardEulerOfHalfTheLength) {
  const Case& c = GetParam();
  const Scene scene(c.scheme, c.dimension, c.dimension == 1 ? 60 : c.dimension == 2 ? 12 : 7);
  BoundaryConditions conditions{.fixed = {scene.left}};
  conditions.fixed.values = Eigen::VectorXd::LinSpaced(scene.left.size(), -1, 1);
  if (c.with_walls) conditions.walls = scene.wall(0.7, 0.3);
  DiffusionOptions options{
      .diffusivity = 0.6, .time_step = c.time_step, .theta = c.theta, .source = scene.field(5)};
  Eigen::MatrixXd u(scene.size(), 2);
  u << scene.field(), scene.field(7);
  ImplicitDiffusion crank(scene.cloud, scene.laplacian, conditions, options);
  if (c.theta != 0.5) {
    const auto damped = [&] { crank.damped_step(u); };
    EXPECT_THAT(message_of<InvalidInput>(damped), testing::HasSubstr("theta must be 0.5, not "));
    return;
  }
  options.theta = 1;
  options.time_step /= 2;
  ImplicitDiffusion euler(scene.cloud, scene.laplacian, conditions, options);
  Eigen::MatrixXd halves = u;
  EXPECT_LE(crank.damped_step(u).residual, 1e-12);
  for (int n = 0; n < 2; ++n) euler.step(halves);
  EXPECT_LT((u - halves).norm(), 1e-9 * halves.norm());  // as the literal steps
}

TEST(Diffusion, ADampedStartMakesCrankNicolsonOfSecondOrderFromAnyField) {
  const Scene scene("laplacian-mixed-zoc", 1, 40);
  const BoundaryConditions conditions{.fixed = {scene.left}, .walls = scene.wall(0.7, 0.3)};
  const Eigen::ArrayXd x = scene.x();
  for (const bool jumps : {false, true}) {  // neither field meets the wall's condition
    const Eigen::VectorXd start = jumps ? (x > 0.4).cast<double>().eval() : (3 * x).sin().eval();
    const auto after = [&](bool damped, int steps) {
      ImplicitDiffusion heat(scene.cloud, scene.laplacian, conditions,
                             {.time_step = 0.2 / steps, .theta = 0.5});
      Eigen::VectorXd u = start;
      for (int n = 0; n < steps; ++n) damped&& n == 0 ? heat.damped_step(u) : heat.step(u);
      return u;
    };
    const Eigen::VectorXd limit = after(true, 16000);
    const auto error = [&](bool damped, int steps) {
      return (after(damped, steps) - limit).norm();
    };
    EXPECT_NEAR(std::log2(error(true, 200) / error(true, 400)), 2, 0.1) << jumps;
    EXPECT_LT(std::log2(error(false, 200) / error(false, 400)), 1.2) << jumps;
    EXPECT_GT(error(false, 20), 10 * error(true, 20));
  }
}

}  // namespace
}  // namespace gradpsi
