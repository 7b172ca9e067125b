#include <cmath>

#include "base/median.hpp"
#include "petsc/processes.hpp"

namespace gradpsi::petsc {
namespace {

using testing::HasSubstr;

TEST(Petsc, MedianIsThatOfAll) {
  for (const int n : {1, 2, 3, 10, 101}) {
    Eigen::VectorXd all(n);
    for (int i = 0; i < n; ++i) all[i] = i % 7 == 3 ? infinity : std::sin(3 * i) * (i % 5);
    const Eigen::VectorXd here = all(given_points(n, Start::NoneOnTheFirst));
    EXPECT_EQ(median(PETSC_COMM_WORLD, here), gradpsi::median(all)) << n;
  }
}

TEST(Petsc, SpacingOfAnEvenNumberNeedsBothMiddlePoints) {
  const Cloud cloud(Positions{{0.0}, {1.0}, {3.5}, {6.5}});
  EXPECT_EQ(cloud.spacing(), 1.75);
  EXPECT_EQ(spacing(partitioned(cloud)), 1.75);
}

TEST(Petsc, PointsFarOutsideTheirBoxCoincideWithTheirImages) {
  const Cloud cloud(Positions{{0.1}, {0.4}, {0.7}, {1000.1}}, {.box = {1, 0, 0}});
  const Partition partition = partitioned(cloud);
  std::vector<std::int64_t> found;
  for (const int k : coincident_points(partition)) found.push_back(partition.cloud().number(k));
  const auto own = own_numbers(partition);
  const bool owns_it = std::ranges::binary_search(own, 3);
  EXPECT_EQ(found, owns_it ? std::vector<std::int64_t>{3} : std::vector<std::int64_t>());
}

TEST(Petsc, AClosePairIsWarnedOfWhoeverOwnsIt) {
  const Cloud lattice = make_cloud({.dimension = 2, .points_per_side = 8});
  for (int i = 0; i < 64; i += 5) {
    Positions x(65, 2);
    x << lattice.positions(), lattice.positions().row(i).array() + 1e-9;
    const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.3);
    const Partition partition = partitioned(Cloud(x));
    const Subdomain mine(partition, support);
    const Neighbours near = find_neighbours(mine, support);
    for (const std::string& warning : warnings(mine.cloud(), near))
      EXPECT_THAT(warning,
                  testing::AnyOf(HasSubstr("points " + std::to_string(i) + " and 64 are"),
                                 HasSubstr("points 64 and " + std::to_string(i) + " are")));
  }
}

TEST(Petsc, HalosMustReachAsFarAsSupports) {
  const Partition partition = partitioned(irregular_cloud(2, 8));
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.4);
  const Subdomain mine(partition, support);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(mine, 2 * support); }),
              HasSubstr("less than the 0.8 that its support may need"));
  const Neighbours near = find_neighbours(mine, support);
  EXPECT_THAT(message_of<InvalidInput>([&] {
                assemble("laplacian-mixed-soc", mine, near, {.on_degenerate = OnDegenerate::Widen});
              }),
              HasSubstr("that widened rows may need"));
}

TEST(Petsc, CoincidentPointsAreFoundWhoeverOwnsThem) {
  const Cloud lattice = make_cloud({.dimension = 2, .points_per_side = 8});
  Positions x(80, 2);
  x << lattice.positions(), lattice.positions()(Eigen::seqN(3, 16, 3), Eigen::all);
  const Cloud cloud(x);
  const Partition partition = partitioned(cloud);
  std::vector<int> found;
  for (const int k : coincident_points(partition))
    found.push_back(static_cast<int>(partition.cloud().number(k)));
  std::vector<int> expected;
  for (const int i : own_numbers(partition))
    if (i >= 64) expected.push_back(i);
  EXPECT_EQ(found, expected);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.3);
  const Subdomain mine(partition, support);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(mine, support); }),
              HasSubstr("coincide at ("));
}

TEST(Petsc, AnErrorAnywhereIsAnErrorEverywhere) {
  const std::string message = message_of<InvalidInput>([] {
    together(PETSC_COMM_WORLD, [] {
      if (rank() == processes() - 1) throw InvalidInput("no");
    });
  });
  const int last = processes() - 1;
  EXPECT_EQ(message, last == 0 ? "no"
                               : "no (on rank " + std::to_string(last) + " of " +
                                     std::to_string(processes()) + ")");
  EXPECT_EQ(message_of<SolverError>(
                [] { together(PETSC_COMM_WORLD, [] { throw SolverError("nor this"); }); }),
            "nor this");
  EXPECT_THROW(together(PETSC_COMM_WORLD, [] { throw std::bad_alloc(); }), std::bad_alloc);
  try {
    together(PETSC_COMM_WORLD, [] { throw StencilError("row", 3, 2, 0.5); });
  } catch (const StencilError& error) {
    EXPECT_EQ(error.point, 3);
    EXPECT_EQ(error.neighbours, 2);
    EXPECT_EQ(error.reciprocal_condition, 0.5);
  }
}

}  // namespace
}  // namespace gradpsi::petsc
