// Laws that solutions obey, and what diffusion must refuse.

#include "diffusion/scene.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

TEST(Diffusion, LinearFieldsAreSteadyWithConsistentSchemes) {
  // u = 2 + 3 x: fixed on the left, its slope given on the right; then 3 u + n . grad u there.
  const Scene scene("laplacian-mixed-soc", 2, 12);
  const Eigen::VectorXd exact = 2 + 3 * scene.x().array();
  for (const double transfer : {0.0, 3.0}) {
    BoundaryConditions conditions{.fixed = {scene.left}, .walls = scene.wall(3, transfer)};
    if (transfer > 0) conditions.walls.flux = (3 + transfer * exact(scene.right).array()).matrix();
    ImplicitDiffusion heat(scene.cloud, scene.laplacian, conditions, {.time_step = infinity});
    Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.size());
    u(scene.left) = exact(scene.left);
    heat.step(u);
    EXPECT_LT((u - exact).cwiseAbs().maxCoeff(), 1e-9);  // rounding, condition number 1e4
  }
}

TEST(Diffusion, WallsCostNoIterations) {
  const Scene scene("laplacian-mixed-zoc", 2, 30);
  const auto iterations = [&](const WallConditions& walls) {
    ImplicitDiffusion heat(scene.cloud, scene.laplacian, {.fixed = {scene.left}, .walls = walls},
                           {.time_step = infinity, .solver = {.method = Method::Krylov}});
    Eigen::VectorXd u = scene.field();
    return heat.step(u).iterations;
  };
  EXPECT_LT(iterations(scene.wall(1)), 2 * iterations({}) + 10);
}

TEST(Diffusion, FixedValuesStayToTheBit) {
  const Scene scene("laplacian-mixed-zoc");
  Eigen::VectorXd u = scene.field();
  const Eigen::VectorXd before = u(scene.left);
  ImplicitDiffusion kept(scene.cloud, scene.laplacian, {.fixed = {scene.left}}, {.time_step = 1});
  kept.step(u);
  EXPECT_EQ(Eigen::VectorXd(u(scene.left)), before);

  const Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(scene.left.size(), 0.1, 0.7);
  ImplicitDiffusion prescribed(scene.cloud, scene.laplacian, {.fixed = {scene.left, values}},
                               {.time_step = 1});
  prescribed.step(u);
  EXPECT_EQ(Eigen::VectorXd(u(scene.left)), values);
}

TEST(Diffusion, SymmetricSchemesConserveHeatAndTheMaximumPrinciple) {
  const Scene scene("laplacian-mixed-zoc", 2, 20);
  ImplicitDiffusion heat(scene.cloud, scene.laplacian, {}, {.time_step = 0.01});
  EXPECT_EQ(heat.solver().method, Method::Cholesky);
  Eigen::VectorXd u = scene.field();
  const Eigen::VectorXd& omega = scene.cloud.volumes();
  const double total = omega.dot(u), least = u.minCoeff(), most = u.maxCoeff();
  for (int n = 0; n < 10; ++n) {
    heat.step(u);
    EXPECT_NEAR(omega.dot(u), total, 1e-13);
    EXPECT_GE(u.minCoeff(), least);
    EXPECT_LE(u.maxCoeff(), most);
  }
}

TEST(Diffusion, NumberDensityVolumesMakeItSymmetricToo) {
  const Cloud cloud(irregular_cloud(2, 12).positions());
  const Operator laplacian =
      assemble("laplacian-mixed-zoc", cloud, find_neighbours(cloud, 3 * cloud.spacing()));
  EXPECT_EQ(ImplicitDiffusion(cloud, laplacian, {}, {.time_step = 1}).solver().method,
            Method::Cholesky);
}

TEST(Diffusion, ManyFieldsAreSteppedAsOneByOne) {
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Scene scene(scheme);
    ImplicitDiffusion heat(scene.cloud, scene.laplacian, {.fixed = {scene.left}},
                           {.time_step = 1e-3, .theta = 0.5});
    Eigen::MatrixXd together(scene.size(), 2);
    together << scene.field(1), scene.field(2);
    Eigen::VectorXd alone = together.col(1);
    heat.step(together);
    heat.step(alone);
    EXPECT_LT((together.col(1) - alone).norm(), 1e-12 * alone.norm());
  }
}

TEST(Diffusion, AnotherTimeStepEqualsAFreshStart) {
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Scene scene(scheme);
    const BoundaryConditions conditions{.fixed = {scene.left}, .walls = scene.wall()};
    Eigen::VectorXd u = scene.field(), v = u;
    ImplicitDiffusion changed(scene.cloud, scene.laplacian, conditions, {.time_step = 1e9});
    changed.set_time_step(infinity);
    changed.set_time_step(1e-3);
    changed.step(u);
    ImplicitDiffusion(scene.cloud, scene.laplacian, conditions, {.time_step = 1e-3}).step(v);
    EXPECT_EQ(u, v);
  }
}

TEST(Diffusion, OtherDrivingEqualsAFreshStart) {
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    const Scene scene(scheme);
    BoundaryConditions conditions{.fixed = {scene.left}, .walls = scene.wall()};
    Eigen::VectorXd u = scene.field(), v = u;
    const Eigen::VectorXd source = 2 * scene.field(1),
                          values = Eigen::VectorXd::LinSpaced(std::ssize(scene.left), 1, 2),
                          flux = Eigen::VectorXd::LinSpaced(std::ssize(conditions.walls.points), -1,
                                                            1);
    ImplicitDiffusion changed(scene.cloud, scene.laplacian, conditions, {.time_step = 1e-3});
    changed.set_source(source);
    changed.set_fixed_values(values);
    changed.set_flux(flux);
    changed.step(u);
    conditions.fixed.values = values;
    conditions.walls.flux = flux;
    ImplicitDiffusion(scene.cloud, scene.laplacian, conditions,
                      {.time_step = 1e-3, .source = source})
        .step(v);
    EXPECT_EQ(u, v);
    EXPECT_THAT(message_of<InvalidInput>([&] { changed.set_source(values); }),
                HasSubstr("source has"));
    EXPECT_THAT(message_of<InvalidInput>([&] { changed.set_flux(nan * flux); }),
                HasSubstr("flux: not finite at point"));
    EXPECT_THROW(changed.set_fixed_values(source), InvalidInput);
  }
}

TEST(Diffusion, AFailedTimeStepDoesNotSolve) {
  const Scene scene("laplacian-mixed-soc");
  ImplicitDiffusion heat(scene.cloud, scene.laplacian, {.walls = scene.wall()},
                         {.time_step = 1e-3});
  Eigen::VectorXd u = scene.field(), v = u;
  EXPECT_THROW(heat.set_time_step(infinity), SolverError);
  EXPECT_THROW(heat.step(u), SolverError);
  heat.set_time_step(1e-3);
  heat.step(u);
  ImplicitDiffusion(scene.cloud, scene.laplacian, {.walls = scene.wall()}, {.time_step = 1e-3})
      .step(v);
  EXPECT_EQ(u, v);
}

TEST(Diffusion, WallsHoldAfterAStepOfHardlyAnyLength) {
  for (const int dimension : {1, 2}) {
    const Scene scene("laplacian-mixed-soc", dimension, dimension == 1 ? 60 : 12);
    for (const Method method : {Method::Auto, Method::Krylov})
      for (const double time_step : {1e-9, 1e-15, 1e-20}) {
        const WallConditions walls = scene.wall(2);
        Eigen::VectorXd u = scene.field();
        ImplicitDiffusion(scene.cloud, scene.laplacian, {.walls = walls},
                          {.time_step = time_step, .solver = {.method = method}})
            .step(u);
        const Eigen::VectorXd slope = walls.gradient[0] * u;
        EXPECT_LT((slope.array() - 2).abs().maxCoeff(), 1e-8) << time_step << name(method);
      }
  }
}

TEST(Fault16, ConditionsAndNumbersOutOfRangeAreNamed) {
  const Scene scene("laplacian-mixed-zoc");
  const auto refused = [&](const BoundaryConditions& conditions, const DiffusionOptions& options) {
    return message_of<InvalidInput>(
        [&] { ImplicitDiffusion(scene.cloud, scene.laplacian, conditions, options); });
  };
  EXPECT_THAT(refused({}, {.time_step = 0}), HasSubstr("time_step must be > 0"));
  EXPECT_THAT(refused({}, {.time_step = nan}), HasSubstr("time_step must be > 0"));
  EXPECT_THAT(refused({}, {.diffusivity = -1, .time_step = 1}), HasSubstr("diffusivity"));
  EXPECT_THAT(refused({}, {.diffusivity = nan, .time_step = 1}), HasSubstr("diffusivity"));
  EXPECT_THAT(refused({}, {.time_step = -1}), HasSubstr("time_step must be > 0"));
  EXPECT_THAT(refused({}, {.time_step = 1, .theta = 0.4}), HasSubstr("theta must be 0.5 to 1"));
  EXPECT_THAT(refused({}, {.time_step = infinity, .theta = 0.5}), HasSubstr("theta = 1"));
  EXPECT_THAT(refused({}, {.time_step = 1, .source = Eigen::VectorXd::Ones(3)}),
              HasSubstr("the source has 3 entries for 100 points"));

  EXPECT_THAT(refused({.fixed = {{100}}}, {.time_step = 1}), HasSubstr("no point 100 among 100"));
  EXPECT_THAT(refused({.fixed = {{7, 7}}}, {.time_step = 1}),
              HasSubstr("point 7 has two conditions"));
  EXPECT_THAT(refused({.fixed = {{7}, Eigen::VectorXd::Ones(2)}}, {.time_step = 1}),
              HasSubstr("fixed.values has 2 entries for 1 points"));
  EXPECT_THAT(refused({.fixed = {scene.right}, .walls = scene.wall()}, {.time_step = 1}),
              HasSubstr("two conditions"));
  WallConditions walls = scene.wall();
  walls.normals.row(1).setZero();
  EXPECT_THAT(refused({.walls = walls}, {.time_step = 1}),
              HasSubstr("the normal at point " + std::to_string(scene.right[1]) + " is zero"));
  walls = scene.wall();
  walls.gradient.pop_back();
  EXPECT_THAT(refused({.walls = walls}, {.time_step = 1}), HasSubstr("1 matrices in 2 dimensions"));
  walls = scene.wall(0, -1);
  EXPECT_THAT(refused({.walls = walls}, {.time_step = 1}), HasSubstr("transfer coefficient"));
}

TEST(Fault25, SteadyStatesThatNothingHoldsAreNamed) {
  const Scene scene("laplacian-mixed-zoc");
  const auto unsolvable = [&](const BoundaryConditions& conditions, double time_step) {
    return message_of<SolverError>([&] {
      ImplicitDiffusion(scene.cloud, scene.laplacian, conditions, {.time_step = time_step});
    });
  };
  EXPECT_THAT(unsolvable({}, infinity), HasSubstr("any constant"));
  EXPECT_THAT(unsolvable({}, 1e20), HasSubstr("any constant"));
  EXPECT_THAT(unsolvable({.walls = scene.wall()}, infinity), HasSubstr("any constant"));
}

TEST(Fault24, AFieldThatIsNotFiniteNamesThePointAndStaysAsItWas) {
  const Scene scene("laplacian-mixed-zoc");
  ImplicitDiffusion heat(scene.cloud, scene.laplacian, {}, {.time_step = 1});
  Eigen::VectorXd u = scene.field();
  u[42] = nan;
  EXPECT_THAT(message_of<InvalidInput>([&] { heat.step(u); }), HasSubstr("at point 42"));
  EXPECT_EQ(u[41], scene.field()[41]);
  Eigen::VectorXd shorter = Eigen::VectorXd::Zero(99);
  EXPECT_THAT(message_of<InvalidInput>([&] { heat.step(shorter); }),
              HasSubstr("99 rows for 100 points"));
}

TEST(Diffusion, EdgesOfItsRange) {
  // No points; all of them fixed; no diffusion.
  const Cloud none(Positions(0, 2));
  const Operator nothing{{SparseMatrix(0, 0)}, {}, {}};
  Eigen::VectorXd empty(0);
  EXPECT_EQ(ImplicitDiffusion(none, nothing, {}, {.time_step = 1}).step(empty).residual, 0);

  const Scene scene("laplacian-mixed-zoc");
  FixedValues all;
  for (int i = 0; i < scene.size(); ++i) all.points.push_back(i);
  Eigen::VectorXd u = scene.field();
  ImplicitDiffusion(scene.cloud, scene.laplacian, {.fixed = all}, {.time_step = 1}).step(u);
  EXPECT_EQ(u, scene.field());
  ImplicitDiffusion(scene.cloud, scene.laplacian, {}, {.diffusivity = 0, .time_step = 1}).step(u);
  EXPECT_LT((u - scene.field()).norm(), 1e-14);
}

}  // namespace
}  // namespace gradpsi
