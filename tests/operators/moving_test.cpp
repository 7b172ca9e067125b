// Points that move within lists that have a skin.

#include <cmath>
#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

/// The same points, each moved by that length at most, one of them by just that.
Cloud moved(const Cloud& cloud, double length) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  Positions x = cloud.positions();
  for (int i = 0; i < cloud.size(); ++i) {
    Eigen::RowVectorXd step(cloud.dimension());
    for (double& component : step) component = normal(generator);
    x.row(i) += step.normalized() * (length * (i == 3 ? 1 - 1e-12 : part(generator)));
  }
  Cloud result = cloud;
  result.move_to(x);
  return result;
}

/// Expects the same rows, but for entries of 0 and rounding, and the same reports.
void expect_same(const Operator& op, const Operator& expected, const std::string& what) {
  EXPECT_EQ(op.rows.neighbours, expected.rows.neighbours) << what;
  EXPECT_EQ(op.rows.outcome, expected.rows.outcome) << what;
  EXPECT_EQ(op.rows.degree, expected.rows.degree) << what;
  EXPECT_EQ(op.rows.supports, expected.rows.supports) << what;
  for (std::size_t a = 0; a < expected.axes.size(); ++a)
    for (int k = 0; k < expected.axes[a].rows(); ++k) {
      const Eigen::RowVectorXd row = op.axes[a].row(k), own = expected.axes[a].row(k);
      // Sums of up to 100 terms in another order, in a system of that condition.
      const double tolerance = 64 * 2.2e-16 / std::max(expected.rows.reciprocal_condition[k], 1e-9);
      EXPECT_LE((row - own).lpNorm<Eigen::Infinity>(), tolerance * own.lpNorm<Eigen::Infinity>())
          << what << " row " << k;
      for (int j = 0; j < row.size(); ++j)
        if (own[j] == 0) {
          EXPECT_EQ(row[j], 0) << what;
        }
    }
}

TEST(Skin, ListsHoldWhoIsWithinSupportAndSkin) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = periodic(irregular_cloud(d, d == 1 ? 40 : 9));
    const Eigen::VectorXd supports = 0.7 * uneven_supports(cloud);
    const Neighbours near = find_neighbours(cloud, supports, Skin{0.1});
    const Neighbours wide = find_neighbours(cloud, supports.array() + 0.1);
    EXPECT_EQ(near.indices, wide.indices);
    EXPECT_EQ(near.offsets, wide.offsets);
    EXPECT_EQ(near.supports, supports);
  }
}

class Moving : public testing::TestWithParam<SchemeAndDimension> {};

TEST_P(Moving, PointsHaveTheRowsOfTheirOwnLists) {
  const auto [scheme, d] = GetParam();
  if (scheme.consistency == Consistency::Kgf) GTEST_SKIP() << "is assembled anew";
  const Cloud open = irregular_cloud(d, d == 1 ? 53 : d == 2 ? 13 : 7);
  for (const Cloud& cloud : {open, periodic(open)}) {
    const Eigen::VectorXd supports = 0.9 * uneven_supports(cloud);
    const double skin = 0.09 * supports.minCoeff();
    const AssemblyOptions options{.on_degenerate = OnDegenerate::Lower};
    const Neighbours near = find_neighbours(cloud, supports, Skin{skin});
    ASSERT_GT(near.indices.size(), find_neighbours(cloud, supports).indices.size());
    Operator op = assemble(scheme, cloud, near, options);
    expect_same(op, assemble(scheme, cloud, find_neighbours(cloud, supports), options), "before");
    const Cloud later = moved(cloud, skin / 2);
    reassemble(scheme, later, near, op, options);
    expect_same(op, assemble(scheme, later, find_neighbours(later, supports), options), "after");
  }
}
INSTANTIATE_TEST_SUITE_P(AllSchemes, Moving, compact_schemes_and_dimensions(), case_name);

TEST(Skin, HigherDegreesStencilsAndWidenedRowsAreTheSame) {
  const Cloud cloud = irregular_cloud(2, 14);
  const double h = 3.4 * cloud.spacing();
  const Neighbours near = find_neighbours(cloud, h, Skin{0.6 * h}), own = find_neighbours(cloud, h);
  for (const Scheme scheme : {"gradient-ls-3", "laplacian-ls-4", "laplacian-positive"})
    for (const auto policy : {OnDegenerate::Lower, OnDegenerate::Widen, OnDegenerate::Zero}) {
      const AssemblyOptions options{.on_degenerate = policy};
      expect_same(assemble(scheme, cloud, near, options), assemble(scheme, cloud, own, options),
                  name(scheme));
    }
  const SparseMatrix psi =
      assemble("laplacian-positive", cloud, own, {.on_degenerate = OnDegenerate::Zero}).matrix();
  EXPECT_EQ(assemble("laplacian-positive", cloud, near, {.on_degenerate = OnDegenerate::Zero})
                .matrix()
                .nonZeros(),
            psi.nonZeros());
}

// A kernel that does not vanish at h: what is beyond has no weight all the same.
TEST(Skin, WeightsEndAtTheSupportWhateverTheKernel) {
  const Kernel cut{.name = "cut",
                   .formula = "2 - q",
                   .profile =
                       [](double q) {
                         return Profile{2 - q, -1 / (q + 0.1), 0};
                       },
                   .normalisation = {1, 1, 1}};
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 0.3, Skin{0.1}), own = find_neighbours(cloud, 0.3);
  for (const char* scheme : {"gradient-direct-foc", "laplacian-mixed-zoc", "laplacian-ls-3"})
    expect_same(assemble(scheme, cloud, near, {.kernel = cut}),
                assemble(scheme, cloud, own, {.kernel = cut}), scheme);
  EXPECT_LT((number_density_volumes(cloud, near, cut) - number_density_volumes(cloud, own, cut))
                .lpNorm<Eigen::Infinity>(),
            1e-15);
}

TEST(Skin, SurfacesAreTheSame) {
  Positions x(400, 3);
  for (int i = 0; i < 400; ++i) {
    const double z = 1 - (2 * i + 1.0) / 400, phi = i * std::numbers::pi * (3 - std::sqrt(5));
    x.row(i) << std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z;
  }
  const Cloud cloud(x);
  const Neighbours near = find_neighbours(cloud, 0.6, Skin{0.2}), own = find_neighbours(cloud, 0.6);
  const AssemblyOptions options{.on_surface = true};
  for (const char* scheme : {"gradient-direct-soc", "laplacian-mixed-soc-ls"}) {
    const Operator op = assemble(scheme, cloud, near, options),
                   expected = assemble(scheme, cloud, own, options);
    expect_same(op, expected, scheme);
    EXPECT_LT((op.volumes - expected.volumes).lpNorm<Eigen::Infinity>(), 1e-15);
  }
}

TEST(Skin, WallsDiagnosesAndSymmetricSupportsAreTheSame) {
  const Cloud cloud = make_cloud({.points_per_side = 12, .jitter = 0.2});
  const Eigen::VectorXd h = (3 + cloud.positions().col(0).array()) * cloud.spacing();
  const Neighbours near = find_neighbours(cloud, h, Skin{0.1}), own = find_neighbours(cloud, h);
  const AssemblyOptions lower{.on_degenerate = OnDegenerate::Lower};
  const Operator op = assemble("laplacian-mixed-soc-ls", cloud, near, lower),
                 expected = assemble("laplacian-mixed-soc-ls", cloud, own, lower);
  FluxWalls walls;
  for (int i = 0; i < cloud.size(); ++i)
    if (cloud.positions()(i, 0) < 1.0 / 12) walls.points.push_back(i);
  walls.normals = Eigen::RowVector2d(-1, 0).replicate(std::ssize(walls.points), 1);
  expect_same(with_walls(op, cloud, near, walls).laplacian,
              with_walls(expected, cloud, own, walls).laplacian, "walls");
  EXPECT_EQ(diagnose("laplacian-mixed-soc-ls", cloud, op).negative_share,
            diagnose("laplacian-mixed-soc-ls", cloud, expected).negative_share);
  const Scheme zoc = "gradient-direct-zoc";
  expect_same(with_symmetric_supports(zoc, assemble(zoc, cloud, near)),
              with_symmetric_supports(zoc, assemble(zoc, cloud, own)), "symmetric");
}

// Fewer than five points within the support, more in the skin.
TEST(Skin, PointsInItDoNotMakeUpForNeighbours) {
  Positions x(7, 2);
  x << 0, 0, 1, 0, -1, 0.1, 0, 1, 0.2, -1, 1.1, 0.9, -1.2, -0.8;
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Ones(7)});
  const Neighbours near = find_neighbours(cloud, 1.2, Skin{1}), own = find_neighbours(cloud, 1.2);
  for (const char* scheme : {"laplacian-mixed-soc", "gradient-ls-2", "laplacian-positive"})
    EXPECT_EQ(message_of<StencilError>([&] { assemble(scheme, cloud, near); }),
              message_of<StencilError>([&] { assemble(scheme, cloud, own); }));
  EXPECT_THAT(message_of<StencilError>([&] { assemble("laplacian-mixed-soc", cloud, near); }),
              HasSubstr("at least 5 neighbours are needed (4 neighbours"));
  EXPECT_EQ(message_of<InvalidInput>([&] { find_neighbours(cloud, 0.5, Skin{1}); }),
            message_of<InvalidInput>([&] { find_neighbours(cloud, 0.5); }));
  EXPECT_EQ(message_of<StencilError>([&] {
              assemble("gradient-direct-zoc", cloud, find_neighbours(cloud, 0.95, Skin{1}));
            }),
            message_of<StencilError>(
                [&] { assemble("gradient-direct-zoc", cloud, find_neighbours(cloud, 0.95)); }));
}

TEST(Stale, IsWhatHasMovedByMoreThanHalfTheSkin) {
  const Cloud cloud = periodic(make_cloud({.points_per_side = 8}));
  const Neighbours near = find_neighbours(cloud, 0.25, Skin{0.125});
  Cloud later = cloud;
  const auto shifted = [&](int i, double by) {
    Positions x = cloud.positions();
    x(i, 1) += by;
    later.move_to(x);
    return later;
  };
  for (const int i : {0, 63}) {
    EXPECT_FALSE(is_stale(near, shifted(i, 0.0625)));
    EXPECT_TRUE(is_stale(near, shifted(i, 0.0625 + 1e-15)));
    EXPECT_FALSE(is_stale(near, shifted(i, 3 - 0.0625)));  // by three boxes less that
    EXPECT_TRUE(is_stale(near, shifted(i, 3.07)));
  }
  EXPECT_FALSE(is_stale(find_neighbours(Cloud(cloud.positions() * 1e-200), 0.25e-200, Skin{1e-202}),
                        Cloud(cloud.positions() * 1e-200)));
  EXPECT_TRUE(is_stale(find_neighbours(Cloud(cloud.positions() * 1e-200), 0.25e-200, Skin{1e-202}),
                       Cloud(cloud.positions() * 1.1e-200)));
}

TEST(Fault47, ListsThatPointsHaveMovedOutOfAreRefused) {
  const Cloud cloud = make_cloud({.points_per_side = 8});
  const Neighbours near = find_neighbours(cloud, 0.4, Skin{0.1});
  Operator op = assemble("laplacian-mixed-zoc", cloud, near);
  const Cloud later = moved(cloud, 0.06);
  const auto message = [](const auto& call) { return message_of<InvalidInput>(call); };
  EXPECT_THAT(message([&] { assemble("laplacian-mixed-zoc", later, near); }), HasSubstr("point 3"));
  EXPECT_THAT(message([&] { reassemble("laplacian-mixed-zoc", later, near, op); }),
              HasSubstr("more than half of their skin, 0.1: find them again"));
  EXPECT_THAT(message([&] { number_density_volumes(later, near); }), HasSubstr("has moved by"));
}

TEST(Fault47, SkinsThatCannotBeAreRefused) {
  const Cloud cloud = periodic(make_cloud({.points_per_side = 8}));
  const auto message = [](const auto& call) { return message_of<InvalidInput>(call); };
  for (const Eigen::VectorXd& supports : {Eigen::VectorXd(0), Eigen::VectorXd(63)})
    EXPECT_EQ(message([&] { find_neighbours(cloud, supports, Skin{0.1}); }),
              message([&] { find_neighbours(cloud, supports); }));
  for (const double width : {0.0, -1.0, std::nan("")})
    EXPECT_THAT(message([&] { find_neighbours(cloud, 0.3, Skin{width}); }),
                HasSubstr("the skin must be > 0 and finite, not "));
  EXPECT_THAT(
      message([&] { find_neighbours(cloud, 0.4, Skin{0.11}); }),
      HasSubstr("support and skin, 0.4 and 0.11, are together more than half the periodic"));
  EXPECT_THAT(message([&] { is_stale(find_neighbours(cloud, 0.3), cloud); }),
              HasSubstr("neighbours without a skin do not tell"));
  const Neighbours near = find_neighbours(cloud, 0.3, Skin{0.1});
  EXPECT_THAT(message([&] { is_stale(near, make_cloud({.points_per_side = 4})); }),
              HasSubstr("the neighbours are of 64 points, the cloud has 16"));
  EXPECT_THAT(message([&] { is_stale(near, make_cloud({.dimension = 3, .points_per_side = 4})); }),
              HasSubstr("among points of 2 coordinates, not 3"));
}

TEST(MovingPoints, KeepWhatTheyAreWhereTheyCannotGo) {
  Cloud cloud = make_cloud({.points_per_side = 3});
  const Positions before = cloud.positions();
  Positions x = before;
  x(4, 1) = std::nan("");
  EXPECT_THAT(message_of<InvalidInput>([&] { cloud.move_to(x); }), HasSubstr("point 4 has"));
  EXPECT_THAT(message_of<InvalidInput>([&] { cloud.move_to(x.topRows(8)); }),
              HasSubstr("positions is 8 x 2 for 9 points in 2 dimensions"));
  EXPECT_EQ(cloud.positions(), before);
}

}  // namespace
}  // namespace gradpsi
