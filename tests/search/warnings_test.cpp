#include <cmath>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

TEST(Fault05, APairMuchCloserThanTheSpacingIsWarnedOf) {
  for (const int d : {1, 2, 3})
    for (const bool uneven : {false, true})
      for (const double box : {0.0, 1.0}) {
        const Cloud cloud = irregular_cloud(d, d == 1 ? 40 : d == 2 ? 12 : 7);
        const double dx = cloud.spacing();
        CloudOptions options{.volumes = cloud.volumes()};
        std::fill_n(options.box.begin(), d, box);
        Positions x = cloud.positions();
        const auto warned = [&] {
          const Cloud moved(x, options);
          const Neighbours near =
              uneven ? find_neighbours(moved,
                                       Eigen::VectorXd::LinSpaced(cloud.size(), 2.5 * dx, 2 * dx))
                     : find_neighbours(moved, 2.5 * dx);
          const auto found = warnings(moved, near, 1);
          EXPECT_EQ(found, warnings(moved, near, 2));
          return found;
        };
        EXPECT_TRUE(warned().empty());
        x.row(30) = x.row(7);
        x(30, 0) += box + 1e-4 * dx;  // in a box, its image
        x.row(31) = x.row(9);
        x(31, 0) += box + 2e-4 * dx;
        if (box == 0) x(31, 0) = x(9, 0) + 2e-4 * dx;
        ASSERT_EQ(warned().size(), 1u);
        EXPECT_THAT(warned()[0], testing::AllOf(HasSubstr("points 7 and 30 are "),
                                                HasSubstr("4 points have one within a hundredth")));
        x(30, 0) += 0.02 * dx;
        x(31, 0) += 0.02 * dx;
        EXPECT_TRUE(warned().empty());
      }
}

TEST(Fault05, TheDistanceAndTheUsualOneAreNamed) {
  Positions x(6, 1);
  x << 0, 2, 4, 6, 8, 8.01;
  EXPECT_THAT(
      warnings(Cloud(x), find_neighbours(Cloud(x), 3.0)),
      testing::ElementsAre(HasSubstr("points 4 and 5 are 0.01 apart, where the nearest point "
                                     "is usually 2 away; 2 points")));
  x *= 1e-200;  // whose squares are no doubles
  EXPECT_THAT(warnings(Cloud(x), find_neighbours(Cloud(x), 3e-200)),
              testing::ElementsAre(HasSubstr("points 4 and 5 are 1e-202 apart")));
  EXPECT_TRUE(
      warnings(Cloud(Positions(0, 2)), find_neighbours(Cloud(Positions(0, 2)), 1.0)).empty());
  EXPECT_TRUE(
      warnings(Cloud(Positions(1, 2)), find_neighbours(Cloud(Positions(1, 2)), 1.0)).empty());
  EXPECT_THROW(warnings(Cloud(x), Neighbours{}), InvalidInput);
}

// What is said about the rounding is what happens: coordinates rounded by an origin far away, operators
// and fields otherwise the same.
TEST(Fault09, AFarOriginIsWarnedOfWithTheErrorThatItCauses) {
  const Cloud cloud = irregular_cloud(2, 50);
  const double support = rich_support(cloud);
  EXPECT_TRUE(warnings(cloud, find_neighbours(cloud, support)).empty());
  const Cloud far(cloud.positions().array() + 1e8, {.volumes = cloud.volumes()});
  const Neighbours near = find_neighbours(far, support);
  const auto found = warnings(far, near);
  ASSERT_EQ(found.size(), 1u);
  const auto number_after = [&](const std::string& words) {
    const auto at = found[0].find(words);
    if (at == std::string::npos) throw std::runtime_error(words + "? " + found[0]);
    return std::stod(found[0].substr(at + words.size()));
  };
  EXPECT_EQ(number_after("coordinates reach "), 1e8);
  const double part = number_after("they are rounded by "),
               curvature = number_after("Laplacians by ");
  EXPECT_EQ(number_after("off by up to about "), part);
  // u = x + y as the points have it that have not been rounded.
  const Eigen::VectorXd u = cloud.positions().rowwise().sum();
  const auto rms = [](const Eigen::VectorXd& e) { return std::sqrt(e.squaredNorm() / e.size()); };
  const double slope = std::sqrt(2.0);
  const Operator gradient = assemble("gradient-ls-1", far, near);
  const Operator laplacian = assemble("laplacian-mixed-soc-ls", far, near);
  const double off = rms(gradient.matrix() * u - Eigen::VectorXd::Ones(u.size())) / slope;
  EXPECT_GT(off, 0.03 * part);
  EXPECT_LT(off, part);
  const double laplacian_off = rms(laplacian.matrix() * u) / slope;
  EXPECT_GT(laplacian_off, 0.1 * curvature);
  EXPECT_LT(laplacian_off, 3 * curvature);
}

}  // namespace
}  // namespace gradpsi
