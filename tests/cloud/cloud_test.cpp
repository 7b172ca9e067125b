#include <cmath>
#include <limits>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

Positions line(std::initializer_list<double> x) {
  Positions p(static_cast<Eigen::Index>(x.size()), 1);
  std::copy(x.begin(), x.end(), p.data());
  return p;
}

TEST(Fault01, NoPointsAreACloud) {
  const Cloud none(Positions(0, 2));
  EXPECT_EQ(none.size(), 0);
  EXPECT_EQ(none.dimension(), 2);
  EXPECT_THROW(none.spacing(), InvalidInput);
}

TEST(Fault03, ACoordinateThatIsNotFiniteNamesThePoint) {
  for (const double bad : {nan, infinity, -infinity})
    EXPECT_THAT(message_of<InvalidInput>([&] {
                  Cloud(line({0, 1, bad, 3}));
                }),
                HasSubstr("point 2 has coordinates ("));
}

TEST(Fault14, AVolumeThatIsNotPositiveNamesThePoint) {
  for (const double bad : {nan, infinity, 0.0, -1.0})
    EXPECT_THAT(message_of<InvalidInput>([&] {
                  Cloud(line({0, 1}), {.volumes = Eigen::Vector2d(1, bad)});
                }),
                HasSubstr("point 1 has volume"));
}

TEST(Fault14, SizesThatDisagreeAreBothNamed) {
  EXPECT_THAT(message_of<InvalidInput>([] {
                Cloud(line({0, 1, 2}), {.volumes = Eigen::Vector2d(1, 1)});
              }),
              HasSubstr("volumes has 2 entries for 3 points"));
}

TEST(Cloud, OneToThreeDimensions) {
  EXPECT_THROW(Cloud(Positions(5, 4)), InvalidInput);
  EXPECT_THROW(Cloud(Positions(5, 0)), InvalidInput);
}

TEST(Cloud, TheBoxIsChecked) {
  EXPECT_THROW(Cloud(line({0}), {.box = {-1, 0, 0}}), InvalidInput);
  EXPECT_THROW(Cloud(line({0}), {.box = {nan, 0, 0}}), InvalidInput);
  EXPECT_THROW(Cloud(line({0}), {.box = {1, 1, 0}}), InvalidInput);
}

TEST(Cloud, SpacingComesFromVolumesIfThereAre) {
  const Positions x = Positions::Random(4, 3);
  const Cloud cloud(x, {.volumes = Eigen::Vector4d(1, 2, 3, 26)});
  EXPECT_DOUBLE_EQ(cloud.spacing(), 2);
}

TEST(Cloud, SpacingIsElseTheMedianNearestDistance) {
  EXPECT_DOUBLE_EQ(Cloud(line({0, 1, 3, 7, 15})).spacing(), 2);  // of 1, 1, 2, 4, 8
  EXPECT_DOUBLE_EQ(Cloud(line({0, 1, 3, 7})).spacing(), 1.5);    // of 1, 1, 2, 4
  // Across the periodic boundary 0 and 15.5 are neighbours.
  EXPECT_DOUBLE_EQ(Cloud(line({0, 3, 7, 15.5}), {.box = {16, 0, 0}}).spacing(), 1.75);
  EXPECT_THROW(Cloud(line({1})).spacing(), InvalidInput);
  EXPECT_THROW(Cloud(line({1, 1, 1})).spacing(), InvalidInput);
  // Far beyond the range in which distances can be squared.
  EXPECT_DOUBLE_EQ(Cloud(line({0, 1e200, 3e200, 7e200, 15e200})).spacing(), 2e200);
  EXPECT_DOUBLE_EQ(Cloud(line({0, 1e-200, 3e-200, 7e-200, 15e-200})).spacing(), 2e-200);
}

TEST(Fault04, DistinctPointsAreTheFirstOfEachGroup) {
  EXPECT_THAT(distinct_points(Cloud(line({5, 2, 5, 2, 1, 5, -0.0, 0.0}))), ElementsAre(0, 1, 4, 6));
  // In a box, 0, 16 and -16 are the same point.
  EXPECT_THAT(distinct_points(Cloud(line({16, 3, -16, 0, 19}), {.box = {16, 0, 0}})),
              ElementsAre(0, 1));
}

TEST(Lattice, FillsItsDomain) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 4, .lower = -1});
  EXPECT_EQ(cloud.size(), 16);
  EXPECT_DOUBLE_EQ(cloud.positions().minCoeff(), -0.75);
  EXPECT_DOUBLE_EQ(cloud.positions().maxCoeff(), 0.75);
  EXPECT_DOUBLE_EQ(cloud.volumes().sum(), 4);
  EXPECT_DOUBLE_EQ(cloud.spacing(), 0.5);
}

TEST(Lattice, JitterIsBoundedSeededAndFillsItsRange) {
  const Lattice plain{.dimension = 3, .points_per_side = 12};
  Lattice moved = plain;
  moved.jitter = 0.2;
  const Positions a = make_cloud(plain).positions();
  const Positions b = make_cloud(moved).positions();
  const double largest = (b - a).cwiseAbs().maxCoeff() * 12;
  EXPECT_LE(largest, 0.2 + 1e-12);
  EXPECT_GT(largest, 0.19);
  EXPECT_NEAR((b - a).mean() * 12, 0, 0.01);
  EXPECT_EQ(b, make_cloud(moved).positions());
  moved.seed = 2;
  EXPECT_NE(b, make_cloud(moved).positions());
}

TEST(Lattice, GradingDrawsPointsTogetherWithTheirVolumes) {
  for (const int d : {1, 2, 3}) {
    Lattice lattice{.dimension = d, .points_per_side = d == 3 ? 31 : 101, .lower = -1, .upper = 2};
    EXPECT_EQ(make_cloud(lattice).positions(), [&] {
      Lattice same = lattice;
      same.grading = 1;
      return make_cloud(same).positions();
    }());
    lattice.grading = 10;
    const Cloud cloud = make_cloud(lattice);
    // The cells fill the domain; the last of the mid-point rule's error.
    EXPECT_NEAR(cloud.volumes().sum(), std::pow(3, d), 5e-3 * std::pow(3, d));
    const DenseVector nearest = nearest_distances(cloud);
    EXPECT_LT(cloud.positions().cwiseAbs().maxCoeff(), 2);
    Eigen::Index centre;
    (cloud.positions().array() - 0.5).matrix().rowwise().norm().minCoeff(&centre);
    const double dx = 3.0 / lattice.points_per_side;
    EXPECT_NEAR(cloud.volumes()[centre], std::pow(dx / 10, d), 1e-12);
    EXPECT_GT(nearest[centre], 0.9 * dx / 10);
    EXPECT_LT(nearest[centre], 2 * dx / 10);
    EXPECT_NEAR(nearest[0], d == 1 ? 2 * dx : dx, 0.2 * dx);
  }
}

TEST(Lattice, NumbersAreChecked) {
  EXPECT_THROW(make_cloud(Lattice{.grading = 0.5}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.periodic = true, .grading = 2}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.dimension = 0}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.points_per_side = 0}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.dimension = 3, .points_per_side = 2000}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.lower = 1, .upper = 1}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.jitter = -0.1}), InvalidInput);
  EXPECT_THROW(make_cloud(Lattice{.lower = -1, .periodic = true}), InvalidInput);
}

TEST(Reorder, KeepsThePointsAndBringsNearOnesTogether) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = periodic(irregular_cloud(d, d == 1 ? 20'000 : d == 2 ? 150 : 28));
    const Reordered reordered = reorder(cloud);
    std::vector<int> sorted = reordered.order;
    std::ranges::sort(sorted);
    for (int i = 0; i < cloud.size(); ++i) ASSERT_EQ(sorted[i], i);
    EXPECT_EQ(reordered.cloud.positions(), cloud.positions()(reordered.order, Eigen::all));
    EXPECT_EQ(reordered.cloud.volumes(), cloud.volumes()(reordered.order));
    EXPECT_EQ(reordered.cloud.box(), cloud.box());
    // The median distance in memory of the points within two spacings: a leaf or two.
    const Neighbours near = find_neighbours(reordered.cloud, 2 * cloud.spacing());
    std::vector<int> jumps;
    for (int i = 0; i < near.size(); ++i)
      for (const int j : near.of(i)) jumps.push_back(std::abs(i - j));
    std::ranges::nth_element(jumps, jumps.begin() + jumps.size() / 2);
    EXPECT_LT(jumps[jumps.size() / 2], 50);
    EXPECT_EQ(reorder(cloud, 1).order, reorder(cloud, 3).order);
  }
  EXPECT_EQ(reorder(Cloud(Positions(0, 2))).cloud.size(), 0);
}

}  // namespace
}  // namespace gradpsi
