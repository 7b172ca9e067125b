// The spacing of points where they are.

#include <algorithm>
#include <cmath>
#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

Cloud random_cloud(int dimension, int count, double length = 1) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> in_box(0, length);
  Positions x(count, dimension);
  for (double& coordinate : x.reshaped()) coordinate = in_box(generator);
  return Cloud(x);
}

class Dimensions : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Spacing, Dimensions, testing::Values(1, 2, 3));

TEST_P(Dimensions, KthNearestAreThoseOfAllPairs) {
  for (const double box : {0.0, 1.0}) {
    Cloud cloud = random_cloud(GetParam(), 300);
    CloudOptions options;
    for (int a = 0; a < GetParam(); ++a) options.box[a] = box;
    cloud = Cloud(cloud.positions(), options);
    for (const int k : {1, 2, 12, 299}) {
      const DenseVector found = kth_nearest_distances(cloud, k);
      for (int i = 0; i < cloud.size(); i += 13) {
        std::vector<double> all;
        for (int j = 0; j < cloud.size(); ++j) {
          Eigen::RowVectorXd r = cloud.positions().row(j) - cloud.positions().row(i);
          if (box > 0) r.array() -= r.array().round();
          if (j != i) all.push_back(r.norm());
        }
        // In a box, images of one point may all be nearer than another point: only the first few agree.
        if (box > 0 && k > 12) continue;
        std::ranges::nth_element(all, all.begin() + k - 1);
        EXPECT_NEAR(found[i], all[k - 1], 1e-14) << k << ", point " << i;
      }
    }
  }
}

TEST_P(Dimensions, KthNearestAsSupportsGiveThatManyNeighbours) {
  const Cloud cloud = random_cloud(GetParam(), 2000);
  const DenseVector h = kth_nearest_distances(cloud, 9) * (1 + 1e-9);
  const Neighbours near = find_neighbours(cloud, h);
  for (int i = 0; i < cloud.size(); ++i) ASSERT_EQ(near.count(i), 9);
}

TEST(Spacing, WhatIsNoNumberOfNearestPointsIsRefused) {
  const Cloud cloud = random_cloud(2, 5);
  for (const int k : {-1, 0, 5})
    EXPECT_THAT(message_of<InvalidInput>([&] { kth_nearest_distances(cloud, k); }),
                HasSubstr("each of 5 points has up to 4 nearest ones, not " + std::to_string(k)));
}

TEST_P(Dimensions, EvenCloudsHaveOneSpacingToTheBit) {
  for (const double jitter : {0.0, 0.3, 0.5}) {
    const int side = std::array{4000, 60, 16}[GetParam() - 1];
    const Cloud cloud =
        make_cloud(Lattice{.dimension = GetParam(), .points_per_side = side, .jitter = jitter});
    for (const Cloud& c : {cloud, Cloud(cloud.positions())}) {
      const DenseVector spacing = local_spacing(c);
      ASSERT_EQ(spacing.size(), 1);
      EXPECT_EQ(spacing[0], c.spacing());
    }
  }
  EXPECT_EQ(local_spacing(random_cloud(GetParam(), 20000)).size(), 1);
}

/// Random points whose coordinates were raised to a power: ever denser towards the origin.
Cloud graded_cloud(int dimension, double power) {
  Positions x = random_cloud(dimension, 20000).positions();
  x = x.array().pow(power);
  return Cloud(x);
}

TEST_P(Dimensions, FollowsGradedPointsAndVariesSlowly) {
  const Cloud cloud = graded_cloud(GetParam(), 3);
  const DenseVector spacing = local_spacing(cloud), reach = kth_nearest_distances(cloud, 12);
  ASSERT_EQ(spacing.size(), cloud.size());
  EXPECT_GT(spacing.maxCoeff() / spacing.minCoeff(), 10);
  const Neighbours near = find_neighbours(cloud, reach * (1 + 1e-9));
  for (int i = 0; i < cloud.size(); ++i)
    for (const int j : near.of(i)) {
      ASSERT_LE(spacing[i], 1.5 * spacing[j] * (1 + 1e-12));
      ASSERT_LE(spacing[j], 1.5 * spacing[i] * (1 + 1e-12));
    }
}

TEST(Spacing, DoesNotDependOnThreadsAndScalesWithThePoints) {
  const Cloud cloud = graded_cloud(2, 2);
  const DenseVector one = local_spacing(cloud, 1), two = local_spacing(cloud, 2);
  EXPECT_EQ(one, two);
  const DenseVector scaled = local_spacing(Cloud(cloud.positions() * 0x1p-30), 1);
  EXPECT_EQ(scaled, one * 0x1p-30);
}

TEST(Spacing, OfGivenVolumesIsTheirRoot) {
  const Cloud cloud = graded_cloud(2, 1);
  Eigen::VectorXd volumes = Eigen::VectorXd::Ones(cloud.size());
  for (int i = 0; i < cloud.size(); ++i)
    volumes[i] = std::pow(1e-3 + 0.05 * cloud.positions()(i, 0), 2);
  const Cloud graded(cloud.positions(), {.volumes = volumes});
  const DenseVector spacing = local_spacing(graded);
  ASSERT_EQ(spacing.size(), cloud.size());
  EXPECT_TRUE((spacing.array() >= volumes.array().sqrt() * (1 - 1e-15)).all());
  EXPECT_GT((spacing.array() <= volumes.array().sqrt() * (1 + 1e-15)).count(), cloud.size() / 2);
}

/// One point far away is neither lost nor makes the others' supports grow without end.
TEST(Spacing, BearsALonePoint) {
  Positions x(2501, 2);
  x.topRows(2500) = make_cloud(Lattice{.points_per_side = 50, .jitter = 0.2}).positions();
  x.row(2500) << 40, 0.5;
  const Cloud cloud(x);
  const DenseVector spacing = local_spacing(cloud);
  const Neighbours near = find_neighbours(cloud, 3 * spacing);
  EXPECT_GT(near.count(2500), 0);
  EXPECT_LT(near.indices.size(), 50 * 2500);
}

}  // namespace
}  // namespace gradpsi
