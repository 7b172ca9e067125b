// Implicit diffusion against its literal formula and against laws that solutions obey.

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A cloud with operators and sides: the points within a spacing of x = 0 and those of x = 1.
struct Scene {
  explicit Scene(const std::string& scheme, int dimension = 2, int side = 10)
      : cloud(irregular_cloud(dimension, side)),
        near(find_neighbours(cloud, rich_support(cloud))),
        laplacian(assemble(scheme, cloud, near)) {
    for (int i = 0; i < cloud.size(); ++i) {
      const double x = cloud.positions()(i, 0);
      if (x < cloud.spacing()) left.push_back(i);
      if (x > 1 - cloud.spacing()) right.push_back(i);
    }
  }
  int size() const { return cloud.size(); }
  Eigen::VectorXd x() const { return cloud.positions().col(0); }
  Eigen::VectorXd field(unsigned seed = 3) const {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> value(-1, 1);
    return Eigen::VectorXd::NullaryExpr(size(), [&] { return value(generator); });
  }
  /// n . grad u + transfer u = flux on the right, n along x.
  WallConditions wall(double flux = 0, double transfer = 0) const {
    const auto count = static_cast<Eigen::Index>(right.size());
    WallConditions walls{.points = right, .normals = Positions::Zero(count, cloud.dimension())};
    walls.normals.col(0).setOnes();
    walls.gradient = assemble("gradient-direct-soc", cloud, near, {.rows = right}).axes;
    walls.flux = Eigen::VectorXd::Constant(count, flux);
    walls.transfer = Eigen::VectorXd::Constant(count, transfer);
    return walls;
  }

  Cloud cloud;
  Neighbours near;
  Operator laplacian;
  std::vector<int> left, right;
};

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
  return A.fullPivLu().solve(b);
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

TEST(Conductivity, ArithmeticMeanIsTheProductRule) {
  for (const int dimension : {1, 2, 3}) {
    const Scene scene("laplacian-diffuse-soc", dimension, dimension == 1 ? 30 : 7);
    const Eigen::VectorXd kappa = 1 + scene.cloud.positions().rowwise().sum().array();
    const Eigen::VectorXd u = scene.field();
    const SparseMatrix& psi = scene.laplacian.matrix();
    const Eigen::VectorXd rule = 0.5 * (psi * kappa.cwiseProduct(u) + kappa.cwiseProduct(psi * u) -
                                        u.cwiseProduct(psi * kappa));
    const Eigen::VectorXd flux = with_conductivity(scene.laplacian, kappa).matrix() * u;
    EXPECT_LT((flux - rule).norm(),
              1e-12 * (psi.cwiseAbs() * u.cwiseAbs()).norm() * kappa.maxCoeff());
    // div((1 + x + ..) grad x) = 1, exact where quadratics are.
    const Eigen::VectorXd ones = with_conductivity(scene.laplacian, kappa).matrix() * scene.x();
    EXPECT_LT((ones.array() - 1).abs().maxCoeff(), 1e-7);
  }
}

TEST(Conductivity, KeepsSymmetryAndRowSums) {
  const Scene scene("laplacian-mixed-zoc");
  const Eigen::VectorXd kappa = scene.field().array().exp();
  for (const Mean mean : {Mean::Arithmetic, Mean::Harmonic}) {
    const Operator flux = with_conductivity(scene.laplacian, kappa, mean);
    const Eigen::MatrixXd S = Eigen::MatrixXd(scene.cloud.volumes().asDiagonal() * flux.matrix());
    EXPECT_LT((S - S.transpose()).cwiseAbs().maxCoeff(), 1e-14 * S.cwiseAbs().maxCoeff());
    EXPECT_LT(S.rowwise().sum().cwiseAbs().maxCoeff(), 1e-14 * S.cwiseAbs().maxCoeff());
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
