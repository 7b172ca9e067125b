// Rows of the Laplacian at walls that know the slope.

#include <cmath>

#include "clouds.hpp"
#include "diffusion/scene.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

/// Jittered points of the unit ball; those near its surface are on it, walls with normals outward.
struct Ball {
  explicit Ball(int dimension, int side = 0) {
    side = side > 0 ? side : std::array{41, 21, 13}[dimension - 1];
    const Cloud box = make_cloud({.dimension = dimension,
                                  .points_per_side = side,
                                  .lower = -1.2,
                                  .upper = 1.2,
                                  .jitter = 0.2});
    dx = 2.4 / side;
    std::vector<int> kept;
    Positions x = box.positions();
    for (int i = 0; i < box.size(); ++i) {
      const double r = x.row(i).norm();
      if (r > 1 + dx / 2) continue;
      if (r > 1 - dx / 2) {
        x.row(i) /= r;
        walls.points.push_back(static_cast<int>(kept.size()));
      }
      kept.push_back(i);
    }
    const Positions inside = x(kept, Eigen::all);
    cloud = Cloud(inside,
                  {.volumes = Eigen::VectorXd::Constant(inside.rows(), std::pow(dx, dimension))});
    walls.normals = 3 * inside(walls.points, Eigen::all);  // of any length
    near = find_neighbours(cloud, 3.2 * dx);
    laplacian =
        assemble("laplacian-mixed-soc-ls", cloud, near, {.on_degenerate = OnDegenerate::Widen});
  }
  double dx;
  Cloud cloud{Positions(0, 1)};
  Neighbours near;
  FluxWalls walls;
  Operator laplacian;
};

class Walls : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimensions, Walls, testing::Values(1, 2, 3));

TEST_P(Walls, RowsAreExactOnQuadraticsAndPositive) {
  Ball ball(GetParam());
  const Eigen::MatrixXd x = ball.cloud.positions();
  Eigen::MatrixXd H = Eigen::MatrixXd::Random(GetParam(), GetParam());
  H = (H + H.transpose()).eval();
  const Eigen::RowVectorXd slope = Eigen::RowVectorXd::Random(GetParam());
  const Eigen::VectorXd u = x * slope.transpose() + (x * H).cwiseProduct(x).rowwise().sum() / 2;
  const Eigen::MatrixXd gradient = (x * H).rowwise() + slope;
  ball.walls.flux.resize(std::ssize(ball.walls.points));
  for (std::size_t k = 0; k < ball.walls.points.size(); ++k)
    ball.walls.flux[k] = gradient.row(ball.walls.points[k]).dot(ball.walls.normals.row(k));
  const WithWalls found = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  const Eigen::VectorXd lap = found.laplacian.matrix() * u + found.source;
  int exact = 0;
  for (const int i : ball.walls.points) {
    for (SparseMatrix::InnerIterator a(found.laplacian.matrix(), i); a; ++a)
      EXPECT_GE(a.col() == i ? -a.value() : a.value(), 0);
    EXPECT_NEAR(found.laplacian.matrix().row(i).sum(), 0, 1e-9);
    ASSERT_NE(found.laplacian.rows.outcome[i], RowOutcome::Zero);
    if (found.laplacian.rows.outcome[i] == RowOutcome::Lowered) continue;
    ++exact;
    EXPECT_NEAR(lap[i], H.trace(), 1e-10 / (ball.dx * ball.dx)) << "wall point " << i;
  }
  EXPECT_GT(exact, 0.9 * std::ssize(ball.walls.points));
  // The others are as they were.
  EXPECT_EQ(found.source.array().abs().sum() > 0, true);
  for (int i = 0; i < ball.cloud.size(); ++i)
    if (found.laplacian.rows.degree[i] == ball.laplacian.rows.degree[i] && found.source[i] == 0 &&
        std::ranges::find(ball.walls.points, i) == ball.walls.points.end()) {
      EXPECT_EQ((found.laplacian.matrix().row(i) - ball.laplacian.matrix().row(i)).norm(), 0);
    }
}

/// -lap u = f on a disc with a flux on the whole circle but for three points that are fixed, or with exchange.
/// @return  the largest errors
std::vector<double> errors_on_a_disc(double transfer) {
  std::vector<double> errors;
  for (const int side : {20, 40, 80}) {
    Ball ball(2, side);
    const auto x = ball.cloud.positions().col(0).array(), y = ball.cloud.positions().col(1).array();
    const Eigen::VectorXd u = (2 * x).sin() * y.cos(), f = 5 * u;
    ball.walls.normals /= 3;
    ball.walls.flux.resize(std::ssize(ball.walls.points));
    for (std::size_t k = 0; k < ball.walls.points.size(); ++k) {
      const int i = ball.walls.points[k];
      ball.walls.flux[k] = 2 * std::cos(2 * x[i]) * std::cos(y[i]) * x[i] -
                           std::sin(2 * x[i]) * std::sin(y[i]) * y[i] + transfer * u[i];
    }
    ball.walls.transfer = Eigen::VectorXd::Constant(ball.walls.flux.size(), transfer);
    const WithWalls walled = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
    BoundaryConditions held;
    if (transfer == 0) held.fixed.points = {0, 1, 2};
    Eigen::VectorXd found = u;
    ImplicitDiffusion(ball.cloud, walled.laplacian, held,
                      {.time_step = infinity, .source = Eigen::VectorXd(f + walled.source)})
        .step(found);
    errors.push_back((found - u).cwiseAbs().maxCoeff());
  }
  return errors;
}

TEST(Walls, FluxAndExchangeOnACircleAreOfSecondOrder) {
  for (const double transfer : {0.0, 2.0}) {
    const std::vector<double> errors = errors_on_a_disc(transfer);
    EXPECT_LT(errors[0], 0.05);
    EXPECT_GT(std::log2(errors[0] / errors[2]) / 2, 1.6) << transfer;
  }
}

TEST_P(Walls, ExchangeIsAFluxThatFollowsTheField) {
  Ball ball(GetParam());
  const auto count = std::ssize(ball.walls.points);
  const WithWalls insulated = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  ball.walls.flux = Eigen::VectorXd::LinSpaced(count, -1, 1);
  ball.walls.transfer = Eigen::VectorXd::LinSpaced(count, 0, 2);
  const WithWalls exchange = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  const Eigen::VectorXd u = Eigen::VectorXd::Random(ball.cloud.size());
  FluxWalls same = ball.walls;
  same.transfer = {};
  for (int k = 0; k < count; ++k) same.flux[k] -= ball.walls.transfer[k] * u[same.points[k]];
  const WithWalls flux = with_walls(ball.laplacian, ball.cloud, ball.near, same);
  const Eigen::VectorXd expected = flux.laplacian.matrix() * u + flux.source;
  EXPECT_LT((exchange.laplacian.matrix() * u + exchange.source - expected).norm(),
            1e-12 * expected.norm());
  // Conductivities multiply what is exchanged by that of the wall point, whatever the mean.
  const double kappa = 2.5;
  const auto conducting = [&](const Operator& laplacian) {
    return with_conductivity(laplacian, Eigen::VectorXd::Constant(ball.cloud.size(), kappa),
                             Mean::Harmonic);
  };
  const Eigen::VectorXd product = conducting(exchange.laplacian).matrix() * u;
  EXPECT_LT((product - kappa * (exchange.laplacian.matrix() * u)).norm(), 1e-12 * product.norm());
  EXPECT_LT((conducting(insulated.laplacian).matrix() * Eigen::VectorXd::Ones(u.size()))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

TEST(Walls, ExchangeDrawsAFieldToItsSurroundingsAndNoFurther) {
  Ball ball(2);
  ball.laplacian =
      assemble("laplacian-positive", ball.cloud, ball.near, {.on_degenerate = OnDegenerate::Widen});
  const auto count = std::ssize(ball.walls.points);
  ball.walls.normals /= 3;
  ball.walls.transfer = Eigen::VectorXd::LinSpaced(count, 0.5, 2);
  ball.walls.flux = 7 * ball.walls.transfer;  // 7 outside
  const WithWalls walled = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  Eigen::VectorXd u = Eigen::VectorXd::Random(ball.cloud.size());
  const double least = u.minCoeff();
  ImplicitDiffusion heat(ball.cloud, walled.laplacian, {},
                         {.time_step = 0.05, .source = walled.source});
  for (int step = 0; step < 400; ++step) {
    heat.step(u);
    EXPECT_GE(u.minCoeff(), least - 1e-9);
    EXPECT_LE(u.maxCoeff(), 7 + 1e-9);
  }
  EXPECT_GT(u.minCoeff(), 7 - 1e-3);
}

TEST(Walls, WithoutFluxNothingLeavesTheRangeItStartedFrom) {
  Ball ball(2);
  ball.laplacian =
      assemble("laplacian-positive", ball.cloud, ball.near, {.on_degenerate = OnDegenerate::Widen});
  const WithWalls walled = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  EXPECT_TRUE(walled.source.isZero(0));
  Eigen::VectorXd u = Eigen::VectorXd::Random(ball.cloud.size());
  const double least = u.minCoeff(), most = u.maxCoeff();
  ImplicitDiffusion heat(ball.cloud, walled.laplacian, {}, {.time_step = 0.01});
  for (int step = 0; step < 30; ++step) heat.step(u);
  EXPECT_GE(u.minCoeff(), least - 1e-9);
  EXPECT_LE(u.maxCoeff(), most + 1e-9);
}

TEST(Walls, WhatCannotBeIsNamed) {
  Ball ball(2);
  const auto message = [&](const FluxWalls& walls) {
    return message_of<InvalidInput>(
        [&] { with_walls(ball.laplacian, ball.cloud, ball.near, walls); });
  };
  FluxWalls walls = ball.walls;
  walls.normals.row(3).setZero();
  EXPECT_THAT(message(walls),
              HasSubstr("the normal at point " + std::to_string(walls.points[3]) + " is zero"));
  walls = ball.walls;
  walls.points[1] = walls.points[0];
  EXPECT_THAT(message(walls), HasSubstr("is a wall twice"));
  walls = ball.walls;
  walls.flux = Eigen::VectorXd::Ones(2);
  EXPECT_THAT(message(walls), HasSubstr("flux has 2 entries"));
  walls = ball.walls;
  walls.transfer = Eigen::VectorXd::Constant(std::ssize(walls.points), -1);
  EXPECT_THAT(message(walls), HasSubstr("must be >= 0 and finite, not -1"));
}

// No weights of one sign make up for a normal that points inward: such a wall remains what it was.
TEST(Walls, ThatCannotBeTakenUpRemain) {
  Ball ball(2);
  ball.walls.normals.row(5) *= -1;
  ball.walls.flux = Eigen::VectorXd::LinSpaced(std::ssize(ball.walls.points), 0, 1);
  ball.walls.transfer = ball.walls.flux;
  const WithWalls found = with_walls(ball.laplacian, ball.cloud, ball.near, ball.walls);
  const int i = ball.walls.points[5];
  ASSERT_EQ(found.remaining.points, std::vector{i});
  EXPECT_EQ(found.remaining.normals, ball.walls.normals.row(5));
  EXPECT_EQ(found.remaining.flux[0], ball.walls.flux[5]);
  EXPECT_EQ(found.remaining.transfer[0], ball.walls.transfer[5]);
  EXPECT_EQ((found.laplacian.matrix().row(i) - ball.laplacian.matrix().row(i)).norm(), 0);
  EXPECT_EQ(found.source[i], 0);
}

}  // namespace
}  // namespace gradpsi
