// Rows whose support grows until they can be solved.

#include <algorithm>
#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

// A corner of a lattice offers three points a side where degree 4 needs five.
TEST(Widen, CornersGetTheSupportTheyNeed) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 12, .jitter = 0.1});
  const double h = 3.4 * cloud.spacing();
  const Neighbours near = find_neighbours(cloud, h);
  EXPECT_THROW(assemble("laplacian-ls-4", cloud, near), StencilError);
  const Operator op =
      assemble("laplacian-ls-4", cloud, near, {.on_degenerate = OnDegenerate::Widen});
  int widened = 0;
  for (int i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(op.rows.degree[i], 4);
    EXPECT_EQ(op.matrix().row(i).nonZeros(), op.rows.neighbours[i] + 1);
    if (op.rows.outcome[i] == RowOutcome::AsAsked) {
      EXPECT_EQ(op.rows.supports[i], h);
      EXPECT_EQ(op.rows.neighbours[i], near.count(i));
      continue;
    }
    ++widened;
    EXPECT_EQ(op.rows.outcome[i], RowOutcome::Widened);
    EXPECT_GT(op.rows.supports[i], h);
    // The row is the one that its support gives to begin with.
    const Operator alone =
        assemble("laplacian-ls-4", cloud, find_neighbours(cloud, op.rows.supports[i]),
                 {.rows = std::vector<int>{i}});
    // Widened rows are solved one at a time; the systems' condition is up to 1e9.
    const Eigen::RowVectorXd row = alone.matrix().row(0);
    EXPECT_LT((op.matrix().row(i) - row).norm(), 1e-7 * row.norm());
    EXPECT_NEAR(op.rows.reciprocal_condition[i] / alone.rows.reciprocal_condition[0], 1, 1e-6);
  }
  EXPECT_EQ(widened, op.rows.degenerate());
  EXPECT_GE(widened, 4);
  EXPECT_LT(widened, 60);
}

TEST(Widen, GradientsKeepOnePattern) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 3, .points_per_side = 7, .jitter = 0.1});
  const Operator op = assemble("gradient-ls-2", cloud, find_neighbours(cloud, 1.45 / 7),
                               {.on_degenerate = OnDegenerate::Widen});
  EXPECT_GT(op.rows.degenerate(), 0);
  const auto& [dx, dy, dz] = std::tie(op.axes[0], op.axes[1], op.axes[2]);
  for (const SparseMatrix* other : {&dy, &dz}) {
    ASSERT_EQ(other->nonZeros(), dx.nonZeros());
    EXPECT_TRUE(
        std::equal(dx.innerIndexPtr(), dx.innerIndexPtr() + dx.nonZeros(), other->innerIndexPtr()));
  }
  const Eigen::VectorXd u = cloud.positions() * Eigen::Vector3d(2, -3, 5);
  EXPECT_NEAR((dz * u).minCoeff(), 5, 1e-9);
  EXPECT_NEAR((dz * u).maxCoeff(), 5, 1e-9);
}

// The second derivatives of shape functions round with the cube of the condition, which is large where a row has
// just enough neighbours.
TEST(Widen, ShapeFunctionsKeepWhatTheyPromise) {
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  Positions x(300, 2);
  for (double& coordinate : x.reshaped()) coordinate = uniform(generator);
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(300, 1.0 / 300)});
  for (const double ratio : {2.2, 2.6, 3.0})
    for (const char* scheme : {"gradient-rkpm-2", "laplacian-rkpm-2"}) {
      const Operator op = assemble(scheme, cloud, find_neighbours(cloud, ratio * cloud.spacing()),
                                   {.on_degenerate = OnDegenerate::Widen});
      EXPECT_EQ(std::ranges::count(op.rows.outcome, RowOutcome::Zero), 0);
      for (std::size_t a = 0; a < op.axes.size(); ++a) {
        const double slope = op.axes.size() == 1 ? 0 : a == 0 ? 2 : -3;
        const Eigen::ArrayXd error = op.axes[a] * (x * Eigen::Vector2d(2, -3));
        const Eigen::ArrayXd unit = op.rows.supports.array().pow(op.axes.size() == 1 ? -2 : -1);
        EXPECT_LE(((error - slope).abs() / unit).maxCoeff(), 1e-5) << scheme << ' ' << ratio;
      }
    }
}

TEST(Widen, StopsAtTheCapAndAtHalfAPeriodicBox) {
  // A lone pair far from the others: nothing within three times the support.
  Positions x = make_cloud(Lattice{.dimension = 2, .points_per_side = 6}).positions();
  x.conservativeResize(38, 2);
  x.row(36) << 9, 9;
  x.row(37) << 9.1, 9;
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(38, 1.0 / 36)});
  const Operator op = assemble("laplacian-ls-2", cloud, find_neighbours(cloud, 0.45),
                               {.on_degenerate = OnDegenerate::Widen});
  for (const int i : {36, 37}) {
    EXPECT_EQ(op.rows.outcome[i], RowOutcome::Zero);
    EXPECT_EQ(op.rows.degree[i], -1);
    EXPECT_EQ(op.matrix().row(i).norm(), 0);
  }
  EXPECT_EQ(op.rows.degenerate(), 2);

  const Cloud box =
      make_cloud(Lattice{.dimension = 2, .points_per_side = 4, .jitter = 0.1, .periodic = true});
  const Operator periodic = assemble("laplacian-ls-6", box, find_neighbours(box, 0.3),
                                     {.on_degenerate = OnDegenerate::Widen});
  EXPECT_EQ(periodic.rows.degenerate(), 16);  // 15 others for 27 conditions
}

}  // namespace
}  // namespace gradpsi
