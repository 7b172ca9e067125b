// lap u = f, on points that may move.

#include "gradpsi/poisson.hpp"

#include "diffusion/scene.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

TEST(Poisson, SolvesTheEquationAtFreePoints) {
  const Scene scene("laplacian-mixed-soc");
  const Eigen::VectorXd u = scene.field(), f = scene.laplacian.matrix() * u;
  Poisson poisson(scene.cloud, scene.laplacian, {.fixed = {.points = scene.left}});
  Eigen::VectorXd found = Eigen::VectorXd::Zero(scene.size());
  for (const int i : scene.left) found[i] = u[i];
  poisson.solve(f, found);
  EXPECT_LT((found - u).norm(), 1e-8 * u.norm());
  EXPECT_EQ(poisson.solver().unknowns, scene.size() - std::ssize(scene.left));
}

TEST(Poisson, TakesAConstantFromWhatNothingHolds) {
  const Cloud cloud = make_cloud({.points_per_side = 20, .jitter = 0.2, .periodic = true});
  const Operator psi = assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, 0.15));
  Eigen::VectorXd f = Eigen::VectorXd::LinSpaced(400, -1, 2), u = Eigen::VectorXd::Zero(400);
  for (const auto& mean : {std::optional<double>(), std::optional<double>(4)}) {
    const SolveReport report = Poisson(cloud, psi, {}, {.mean = mean}).solve(f, u);
    const Eigen::VectorXd left = f - psi.matrix() * u;
    EXPECT_NEAR(cloud.volumes().dot(u) / cloud.volumes().sum(), mean.value_or(0), 1e-9);
    EXPECT_LT(left.maxCoeff() - left.minCoeff(), 1e-8);
    EXPECT_NEAR(report.removed, std::abs(left.mean()), 1e-8);
  }
}

TEST(Poisson, IsTheSameWhereverItHasBeenBefore) {
  Scene scene("laplacian-mixed-soc");
  const Scene later("laplacian-ls-2", 2, 12);
  const Eigen::VectorXd f = later.field();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(later.size()), v = u;
  Poisson poisson(scene.cloud, scene.laplacian, {.fixed = {.points = scene.left}});
  Eigen::VectorXd before = Eigen::VectorXd::Zero(scene.size());
  poisson.solve(scene.field(), before);
  const BoundaryConditions conditions{.fixed = {.points = later.left}, .walls = later.wall(2)};
  poisson.update(later.cloud, later.laplacian, conditions);
  poisson.solve(f, u);
  Poisson(later.cloud, later.laplacian, conditions).solve(f, v);
  EXPECT_EQ(u, v);
  // Walls must be given again, other conditions remain.
  EXPECT_THAT(message_of<InvalidInput>([&] { poisson.update(later.cloud, later.laplacian); }),
              HasSubstr("walls have another gradient"));
  poisson.update(later.cloud, later.laplacian, {.fixed = {.points = later.right}});
  poisson.update(later.cloud, later.laplacian);
  u.setOnes();
  poisson.solve(f, u);
  for (const int i : later.right) EXPECT_EQ(u[i], 1);
  EXPECT_THAT(message_of<InvalidInput>([&] { poisson.solve(scene.field(), u); }),
              HasSubstr("f has 100 values, u 144"));
}

TEST(Diffusion, IsUpdatedToOtherPointsWithItsSourceAndStep) {
  const Scene scene("laplacian-mixed-zoc"), moved("laplacian-ls-2");
  ImplicitDiffusion heat(scene.cloud, scene.laplacian, {}, {.time_step = 1, .theta = 0.5});
  heat.set_source(moved.field(8));
  heat.set_time_step(0.01);
  const BoundaryConditions conditions{.fixed = {.points = scene.left}, .walls = moved.wall(1, 2)};
  heat.update(moved.cloud, moved.laplacian, conditions);
  Eigen::VectorXd u = scene.field(), v = u;
  heat.step(u);
  ImplicitDiffusion(moved.cloud, moved.laplacian, conditions,
                    {.time_step = 0.01, .theta = 0.5, .source = moved.field(8)})
      .step(v);
  EXPECT_EQ(u, v);
}

TEST(Diffusion, LeavesOutTheZerosOfASkin) {
  const Scene scene("laplacian-mixed-zoc");
  const double support = scene.near.support(0);
  const Neighbours wide = find_neighbours(scene.cloud, support, Skin{support / 4});
  const Operator psi = assemble("laplacian-mixed-zoc", scene.cloud, wide);
  EXPECT_GT(psi.matrix().nonZeros(), scene.laplacian.matrix().nonZeros());
  const BoundaryConditions conditions{.fixed = {.points = scene.left}, .walls = scene.wall()};
  const DiffusionSystem with(scene.cloud, psi, conditions, {.time_step = 1}),
      without(scene.cloud, scene.laplacian, conditions, {.time_step = 1});
  EXPECT_EQ(with.matrix().nonZeros(), without.matrix().nonZeros());
  EXPECT_LT((with.matrix() - without.matrix()).norm(), 1e-12 * without.matrix().norm());
}

TEST(Diffusion, HasNothingToStepWithAfterAnUpdateInVain) {
  const Scene scene("laplacian-mixed-soc"), other("laplacian-mixed-soc", 2, 13);
  ImplicitDiffusion heat(scene.cloud, scene.laplacian, {.fixed = {.points = scene.left}},
                         {.time_step = infinity, .theta = 1});
  // Nothing is fixed: singular.
  EXPECT_THROW(heat.update(other.cloud, other.laplacian, {}), SolverError);
  Eigen::VectorXd u = other.field();
  EXPECT_THROW(heat.step(u), SolverError);
  // In steps it is not: those of the new points.
  Eigen::VectorXd v = u;
  heat.set_time_step(0.1);
  heat.step(u);
  ImplicitDiffusion(other.cloud, other.laplacian, {}, {.time_step = 0.1}).step(v);
  EXPECT_LT((u - v).norm(), 1e-9 * v.norm());
  u = scene.field();
  heat.update(scene.cloud, scene.laplacian, {.fixed = {.points = scene.left}});
  heat.step(u);
}

}  // namespace
}  // namespace gradpsi
