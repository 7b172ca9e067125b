#include <cmath>
#include <limits>
#include <vector>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

/// Neighbours of points 0, every, 2 every, .. by looking at all others and, in periodic directions, all images.
std::vector<std::vector<int>> all_pairs(const Cloud& cloud, const Eigen::VectorXd& supports,
                                        int every) {
  std::vector<std::vector<int>> rows(cloud.size());
  for (int i = 0; i < cloud.size(); i += every)
    for (int j = 0; j < cloud.size(); ++j) {
      double squared = 0;
      for (int a = 0; a < cloud.dimension(); ++a) {
        const double difference = cloud.positions()(j, a) - cloud.positions()(i, a);
        double least = std::abs(difference);
        for (const int k : {-2, -1, 1, 2})
          least = std::min(least, std::abs(difference + k * cloud.box()[a]));
        squared += least * least;
      }
      const double h = supports[supports.size() == 1 ? 0 : i];
      if (j != i && squared < h * h) rows[i].push_back(j);
    }
  return rows;
}

void expect_equal_to_all_pairs(const Cloud& cloud, const Eigen::VectorXd& supports, int every = 1) {
  const Neighbours near = find_neighbours(cloud, supports);
  const auto expected = all_pairs(cloud, supports, every);
  ASSERT_EQ(near.size(), cloud.size());
  for (int i = 0; i < cloud.size(); i += every)
    EXPECT_THAT(near.of(i), testing::ElementsAreArray(expected[i])) << "row " << i;
}

class Search : public testing::TestWithParam<int> {
 protected:
  int dimension() const { return GetParam(); }
  Cloud cloud() const { return irregular_cloud(dimension(), dimension() == 3 ? 9 : 22); }
  /// Enough for several chunks of work, so that threads have something to share.
  Cloud large_cloud() const {
    return irregular_cloud(dimension(), dimension() == 1 ? 6000 : dimension() == 2 ? 80 : 19);
  }
};

TEST_P(Search, FindsWhatAllPairsFind) {
  expect_equal_to_all_pairs(cloud(), Eigen::VectorXd::Constant(1, 2.7 * cloud().spacing()));
}

TEST_P(Search, TakesOneSupportPerRow) {
  Eigen::VectorXd supports = Eigen::VectorXd::LinSpaced(cloud().size(), 0.9, 3.1);
  expect_equal_to_all_pairs(cloud(), supports * cloud().spacing());
}

TEST_P(Search, SeesTheImagesInAPeriodicBox) {
  CloudOptions options{.box = {1, 1, 1}};
  std::fill(options.box.begin() + dimension(), options.box.end(), 0);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 2.7 * cloud().spacing());
  expect_equal_to_all_pairs(Cloud(cloud().positions(), options), support);
  // Points may lie outside the box and stand for their image.
  const Positions outside = cloud().positions().array() - 0.35;
  expect_equal_to_all_pairs(Cloud(outside, options), support);
  if (dimension() > 1) {
    options.box[0] = 0;  // one direction open
    expect_equal_to_all_pairs(Cloud(cloud().positions(), options), support);
  }
}

TEST_P(Search, FindsWhatAllPairsFindInLargeClouds) {
  const Cloud cloud = large_cloud();
  expect_equal_to_all_pairs(cloud, Eigen::VectorXd::Constant(1, 1.9 * cloud.spacing()), 7);
  CloudOptions options{.box = {1, 1, 1}};
  std::fill(options.box.begin() + dimension(), options.box.end(), 0);
  expect_equal_to_all_pairs(Cloud(cloud.positions(), options),
                            Eigen::VectorXd::Constant(1, 1.9 * cloud.spacing()), 7);
}

TEST_P(Search, DoesNotDependOnTheNumberOfThreads) {
  const Cloud cloud = large_cloud();
  const double support = 2.5 * cloud.spacing();
  const Neighbours one = find_neighbours(cloud, support, 1);
  const Eigen::VectorXd volumes = number_density_volumes(cloud, one, kernels()[0], 1);
  const Eigen::VectorXd nearest = nearest_distances(cloud, 1);
  for (const int threads : {2, 5}) {
    const Neighbours many = find_neighbours(cloud, support, threads);
    EXPECT_EQ(many.offsets, one.offsets);
    EXPECT_EQ(many.indices, one.indices);
    EXPECT_EQ(number_density_volumes(cloud, one, kernels()[0], threads), volumes);
    EXPECT_EQ(nearest_distances(cloud, threads), nearest);
  }
}

TEST_P(Search, NumberDensityIsOneOverTheSumOfTheKernel) {
  const Cloud cloud = this->cloud();
  const Eigen::VectorXd supports =
      Eigen::VectorXd::LinSpaced(cloud.size(), 1.5, 3.1) * cloud.spacing();
  const Neighbours near = find_neighbours(cloud, supports);
  for (const Kernel& k : kernels()) {
    const Eigen::VectorXd volumes = number_density_volumes(cloud, near, k);
    for (int i = 0; i < cloud.size(); i += 13) {
      double sum = 0;
      for (int j = 0; j < cloud.size(); ++j)
        sum += evaluate(k, dimension(), supports[i],
                        (cloud.positions().row(j) - cloud.positions().row(i)).norm())
                   .w;
      EXPECT_NEAR(volumes[i] * sum, 1, 1e-12) << k.name;
    }
  }
}

TEST_P(Search, WorksAtAnyScale) {
  const Neighbours plain = find_neighbours(cloud(), 0.23);
  for (const double scale : {std::ldexp(1.0, 660), std::ldexp(1.0, -660)}) {
    const Neighbours scaled = find_neighbours(Cloud(cloud().positions() * scale), 0.23 * scale);
    EXPECT_EQ(scaled.indices, plain.indices);
  }
}

INSTANTIATE_TEST_SUITE_P(Dimensions, Search, testing::Values(1, 2, 3),
                         [](const auto& p) { return std::to_string(p.param) + "d"; });

TEST(Neighbours, HalfABoxIsTheLargestPeriodicSupport) {
  // On this lattice every point has one at exactly half a box, the same point in two images.
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 6, .periodic = true});
  const Neighbours near = find_neighbours(cloud, 0.5);
  for (int i = 0; i < near.size(); ++i)
    EXPECT_TRUE(std::ranges::adjacent_find(near.of(i)) == near.of(i).end());
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, 0.51); }),
              HasSubstr("more than half the periodic box"));
}

TEST(Neighbours, NumberDensityOfALatticeIsItsVolume) {
  for (const int d : {1, 2, 3}) {
    const Cloud lattice =
        make_cloud(Lattice{.dimension = d, .points_per_side = 16, .periodic = true});
    const Neighbours near = find_neighbours(lattice, 5.3 / 16);
    for (const Kernel& k : kernels()) {
      const Eigen::VectorXd v = number_density_volumes(lattice, near, k);
      EXPECT_NEAR(v.minCoeff() / lattice.volumes()[0], 1, 0.01) << d << k.name;
      EXPECT_NEAR(v.maxCoeff() / lattice.volumes()[0], 1, 0.01) << d << k.name;
    }
  }
}

TEST(Neighbours, NearestDistancesAgreeWithAllPairs) {
  const Cloud cloud = irregular_cloud(2, 15);
  const Eigen::VectorXd nearest = nearest_distances(cloud);
  for (int i = 0; i < cloud.size(); ++i) {
    Eigen::VectorXd distance =
        (cloud.positions().rowwise() - cloud.positions().row(i)).rowwise().norm();
    distance[i] = 1e9;
    EXPECT_DOUBLE_EQ(nearest[i], distance.minCoeff());
  }
}

TEST(Neighbours, PointsMayBeFartherApartThanADouble) {
  Positions x = irregular_cloud(1, 9000).positions() * 2000;
  const Neighbours near = find_neighbours(Cloud(x), 1);
  x(0, 0) = 1.5e308, x(1, 0) = -1.5e308;
  const Neighbours far = find_neighbours(Cloud(x), 1);
  EXPECT_EQ(far.count(0), 0);
  EXPECT_EQ(far.count(1), 0);
  EXPECT_GT(far.indices.size(), 0.99 * static_cast<double>(near.indices.size()));
}

TEST(Fault01, NoPointsHaveNoNeighbours) {
  const Neighbours near = find_neighbours(Cloud(Positions(0, 3)), 1.0);
  EXPECT_EQ(near.size(), 0);
}

TEST(Fault02, OnePointHasNoNeighbour) {
  const Neighbours near = find_neighbours(Cloud(Positions::Zero(1, 2)), 1.0);
  EXPECT_EQ(near.size(), 1);
  EXPECT_EQ(near.count(0), 0);
  EXPECT_EQ(nearest_distances(Cloud(Positions::Zero(1, 2)))[0],
            std::numeric_limits<double>::infinity());
}

TEST(Fault04, CoincidentPointsNameTheFirstPairAndTheCount) {
  Positions x = irregular_cloud(2, 10).positions();
  x.row(70) = x.row(12);
  x.row(80) = x.row(12);
  x.row(25) = x.row(90);
  const auto message = message_of<InvalidInput>([&] { find_neighbours(Cloud(x), 0.3); });
  EXPECT_THAT(message, HasSubstr("points 12 and 70 coincide at ("));
  EXPECT_THAT(message, HasSubstr("3 of 100 points"));
}

TEST(Fault04, PointsCoincideAcrossThePeriodicBoundary) {
  Positions x(3, 1);
  x << 0, 0.4, 1;
  const Cloud cloud(x, {.box = {1, 0, 0}});
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, 0.45); }),
              HasSubstr("points 0 and 2 coincide"));
}

// Decimal coordinates that differ by a period differ by rounding once they are wrapped.
TEST(Fault04, PointsCoincideAcrossThePeriodicBoundaryUpToRounding) {
  Positions x(6, 1);
  x << 0.1, 0.3, 0.5, 0.7, 0.9, 1.1;
  for (const double unit : {1.0, 1e-3, 1e6}) {
    const Cloud cloud(x * unit, {.box = {unit, 0, 0}});
    EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, 0.25 * unit); }),
                HasSubstr("points 0 and 5 coincide"));
    EXPECT_EQ(distinct_points(cloud).size(), 5u);
  }
}

TEST(Fault08, PointsTooCloseForTheSupportAreNotCalledCoincident) {
  const Cloud cloud = irregular_cloud(2, 5);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, 1e300); }),
              HasSubstr("vanishes beside a support of 1e+300"));
}

// Beside the last support that passes, points at less and at more than the least one are told apart.
TEST(Fault08, SupportsWhoseSquaresCannotBeComparedAreRefused) {
  const Cloud cloud((Positions(4, 1) << 0, 1, 2.99, 5.01).finished(), {});
  Eigen::VectorXd supports = Eigen::VectorXd::Constant(4, 2);
  supports[0] = 1e145;
  const Neighbours near = find_neighbours(cloud, supports);
  for (const int j : {0, 2, 3}) EXPECT_EQ(std::ranges::count(near.of(1), j), j < 3);
  supports[0] = 1e161;
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, supports); }),
              HasSubstr("the support of point 1, 2, vanishes beside that of point 0, 1e+161"));
  EXPECT_THROW(find_neighbours(cloud, supports, Skin{0.1}), InvalidInput);
  EXPECT_THROW(interpolate("value-mls-1", cloud, cloud.positions(), supports), InvalidInput);
}

TEST(Fault06, AMillionCoincidentPointsAreNamedBeforeAnythingIsAllocated) {
  EXPECT_THAT(
      message_of<InvalidInput>([] { find_neighbours(Cloud(Positions::Ones(1'000'000, 2)), 1.0); }),
      HasSubstr("points 0 and 1 coincide at (1, 1); 999999 of 1000000 points"));
}

TEST(Fault10, ANeighbourAtExactlyTheSupportDoesNotMatter) {
  const Cloud lattice = make_cloud(Lattice{.dimension = 2, .points_per_side = 12});
  for (const Kernel& k : kernels())
    for (const Scheme& scheme : compact_schemes()) {
      const double h = 3.0 / 12;  // some neighbours at h, found or not
      const AssemblyOptions options{.kernel = k};
      const auto just_less =
          assemble(scheme, lattice, find_neighbours(lattice, h * (1 - 1e-9)), options);
      const auto just_more =
          assemble(scheme, lattice, find_neighbours(lattice, h * (1 + 1e-9)), options);
      for (std::size_t a = 0; a < just_less.axes.size(); ++a)
        EXPECT_LT(SparseMatrix(just_less.axes[a] - just_more.axes[a]).norm(),
                  1e-5 * just_less.axes[a].norm())
            << k.name << " " << name(scheme);
    }
}

TEST(Fault12, TheSupportMustBePositive) {
  const Cloud cloud = irregular_cloud(2, 5);
  for (const double bad : {0.0, -0.3, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, bad); }),
                HasSubstr("support must be > 0 and finite"));
  Eigen::VectorXd supports = Eigen::VectorXd::Constant(25, 0.5);
  supports[7] = -0.5;
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(cloud, supports); }),
              HasSubstr("the support of point 7 must be > 0 and finite, not -0.5"));
}

TEST(Fault13, ASupportBelowTheSpacingNamesTheNearestDistance) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 8});
  const auto message = message_of<InvalidInput>([&] { find_neighbours(cloud, 0.01); });
  EXPECT_THAT(message, HasSubstr("64 of 64 points have no neighbour within the support 0.01"));
  EXPECT_THAT(message, HasSubstr("the median distance to the nearest point is 0.125"));
}

TEST(Fault14, SupportsThatDisagreeInSizeAreBothNamed) {
  EXPECT_THAT(message_of<InvalidInput>([] {
                find_neighbours(irregular_cloud(2, 5), Eigen::VectorXd::Constant(24, 0.5));
              }),
              HasSubstr("supports has 24 entries for 25 points"));
}

TEST(Fault06, ASupportAsLargeAsTheDomainIsRefusedWithTheBytesItWouldTake) {
  // 60,000 points that all see each other: 3.6e9 entries.
  const Cloud line = make_cloud(Lattice{.dimension = 1, .points_per_side = 60'000});
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(line, 2.0); }),
              testing::AllOf(HasSubstr("at most 2^31 - 1 entries"), HasSubstr("GB")));
}

// A support that reaches everything, and a point that nothing reaches.
TEST(Fault45, OneHugeSupportAndALonePointChangeNothingForTheOthers) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(d, d == 3 ? 9 : 22);
    const int n = cloud.size();
    Positions x(n + 1, d);
    x.topRows(n) = cloud.positions();
    x.row(n).setConstant(1e6);
    const Cloud with_lone(x);
    Eigen::VectorXd supports = Eigen::VectorXd::Constant(n + 1, 2.1 * cloud.spacing());
    supports[n / 2] = 1e3;
    expect_equal_to_all_pairs(with_lone, supports);
    EXPECT_THAT(warnings(with_lone, find_neighbours(with_lone, supports)), testing::IsEmpty());
  }
}

TEST(Neighbours, ThreadsAreChecked) {
  for (const int bad : {-1, 100'000})
    EXPECT_THROW(find_neighbours(irregular_cloud(1, 9), 0.5, bad), InvalidInput);
}

TEST(Neighbours, NumberDensityNeedsTheNeighboursOfTheSamePoints) {
  const Neighbours near = find_neighbours(irregular_cloud(2, 5), 0.5);
  EXPECT_THROW(number_density_volumes(irregular_cloud(2, 6), near), InvalidInput);
}

TEST(Neighbours, ANumberDensityBeyondADoubleIsRefused) {
  const Cloud tiny(irregular_cloud(3, 5).positions() * 1e-108);
  const Neighbours near = find_neighbours(tiny, 0.5e-108);
  EXPECT_THAT(message_of<InvalidInput>([&] { number_density_volumes(tiny, near); }),
              HasSubstr("the number density of point 0 with support 5e-109"));
}

}  // namespace
}  // namespace gradpsi
