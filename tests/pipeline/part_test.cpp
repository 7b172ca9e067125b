// A part of a cloud, its own points and those within reach of them, has the rows of the whole, to the bit:
// what processes that share a cloud rely on.

#include <limits>

#include "clouds.hpp"

namespace gradpsi {
namespace {

/// Every third of the width of a cloud, with the points around it.
struct Part {
  Part(const Cloud& whole, const Eigen::VectorXd& supports, int third, double reach) {
    const auto distance = [&](double x) {  // from the third
      const double middle = (third + 0.5) / 3;
      double off = std::abs(x - middle);
      if (whole.box()[0] > 0) off = std::min(off, whole.box()[0] - off);
      return off - 1.0 / 6;
    };
    CloudOptions options{.box = whole.box()};
    for (int i = 0; i < whole.size(); ++i) {
      const double off = distance(whole.positions()(i, 0));
      if (off > reach) continue;
      if (off <= 0) rows.push_back(static_cast<int>(points.size()));
      points.push_back(i);
    }
    if (whole.has_volumes()) options.volumes = whole.volumes()(points);
    options.numbers.assign(points.begin(), points.end());
    cloud = Cloud(whole.positions()(points, Eigen::all), options);
    near = find_neighbours(
        cloud, supports.size() == 1 ? supports : Eigen::VectorXd(supports(points)), rows);
  }
  /// Of the whole cloud.
  int number(int i) const { return points[i]; }

  std::vector<int> points, rows;
  Cloud cloud = Cloud(Positions(0, 1));
  Neighbours near;
};

/// Whether two rows have the same entries to the bit, those of `part` by other names.
void expect_same_row(const SparseMatrix& part, int k, const std::vector<int>& names,
                     const SparseMatrix& whole, int i) {
  ASSERT_EQ(part.row(k).nonZeros(), whole.row(i).nonZeros());
  SparseMatrix::InnerIterator a(part, k), b(whole, i);
  for (; a && b; ++a, ++b) {
    ASSERT_EQ(names[a.col()], b.col());
    ASSERT_EQ(a.value(), b.value()) << "row " << i;
  }
}

class PartOfACloud : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  Scheme scheme() const { return std::get<0>(GetParam()); }
  Cloud cloud() const {
    const int d = std::get<1>(GetParam());
    return irregular_cloud(d, d == 1 ? 90 : d == 2 ? 20 : 11);
  }
  void expect_rows_of(const Cloud& whole, const Eigen::VectorXd& supports,
                      AssemblyOptions options = {.on_degenerate = OnDegenerate::Zero},
                      double reach = 1) const {
    const Operator all = assemble(scheme(), whole, find_neighbours(whole, supports), options);
    for (int third = 0; third < 3; ++third) {
      const Part part(whole, supports, third, reach * supports.maxCoeff());
      AssemblyOptions some = options;
      some.rows = part.rows;
      const Operator op = assemble(scheme(), part.cloud, part.near, some);
      EXPECT_EQ(op.points, part.rows);
      for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
        for (std::size_t k = 0; k < part.rows.size(); ++k)
          expect_same_row(op.axes[axis], static_cast<int>(k), part.points, all.axes[axis],
                          part.number(part.rows[k]));
    }
  }
};

TEST_P(PartOfACloud, HasTheRowsOfTheWhole) {
  expect_rows_of(cloud(), Eigen::VectorXd::Constant(1, rich_support(cloud())));
}
TEST_P(PartOfACloud, HasThemWithASupportPerPoint) {
  expect_rows_of(cloud(), uneven_supports(cloud()));
}
TEST_P(PartOfACloud, HasThemInAPeriodicBox) {
  expect_rows_of(periodic(cloud()), Eigen::VectorXd::Constant(1, rich_support(cloud())));
}
TEST_P(PartOfACloud, HasThemWhereRowsAreWidened) {
  expect_rows_of(cloud(), Eigen::VectorXd::Constant(1, 1.5 * cloud().spacing()),
                 {.on_degenerate = OnDegenerate::Widen}, widest);
}
INSTANTIATE_TEST_SUITE_P(
    Parts, PartOfACloud,
    testing::Combine(testing::Values(Scheme("gradient-direct-soc"), Scheme("laplacian-mixed-zoc"),
                                     Scheme("laplacian-mixed-soc"), Scheme("laplacian-positive")),
                     testing::Values(1, 2, 3)),
    case_name);

TEST(PartOfACloud, HasTheNeighboursOfItsRowsOnly) {
  const Cloud whole = irregular_cloud(2, 15);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(whole));
  const Neighbours all = find_neighbours(whole, support);
  const Neighbours some = find_neighbours(whole, support, {3, 200, 17});
  for (int i = 0; i < whole.size(); ++i)
    if (i == 3 || i == 17 || i == 200)
      EXPECT_TRUE(std::ranges::equal(some.of(i), all.of(i)));
    else
      EXPECT_EQ(some.count(i), 0);
  EXPECT_EQ(find_neighbours(whole, support, std::vector<int>()).indices.size(), 0);
  for (const std::vector<int>& bad : {std::vector{225}, {-1}, {3, 3}})
    EXPECT_THROW(find_neighbours(whole, support, bad), InvalidInput);
}

TEST(PartOfACloud, HasTheRowsOfTheWholesDiffusion) {
  const Cloud whole = irregular_cloud(2, 20);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(whole));
  const Neighbours near = find_neighbours(whole, support);
  const auto x = whole.positions().col(0), y = whole.positions().col(1);
  const Eigen::VectorXd kappa = 1 + x.array().square(), source = (5 * y).array().sin(),
                        u = (4 * x + y).array().cos();
  std::vector<int> left, right;
  for (int i = 0; i < whole.size(); ++i)
    if (x[i] < 0.1)
      left.push_back(i);
    else if (x[i] > 0.9)
      right.push_back(i);
  const auto walls = [](const Cloud& cloud, const Neighbours& lists,
                        const std::vector<int>& points) {
    const auto count = static_cast<Eigen::Index>(points.size());
    return WallConditions{points, Positions::Constant(count, 2, 0.6),
                          assemble("gradient-direct-soc", cloud, lists, {.rows = points}).axes,
                          Eigen::VectorXd::Constant(count, 2),
                          Eigen::VectorXd::Constant(count, 0.3)};
  };
  const DiffusionOptions options{
      .diffusivity = 0.3, .time_step = 0.01, .theta = 0.5, .source = source};
  DiffusionSystem all(whole, with_conductivity(assemble("laplacian-mixed-soc", whole, near), kappa),
                      {.fixed = {left}, .walls = walls(whole, near, right)}, options);
  const auto right_hand_side = [](DiffusionSystem& system, const Eigen::VectorXd& field) {
    const Eigen::VectorXd product = system.matrix() * field(system.columns());
    Eigen::VectorXd b(system.matrix().rows());
    const auto numbers = [](auto& vector) {
      return std::span(vector.data(), static_cast<std::size_t>(vector.size()));
    };
    system.right_hand_side(numbers(field), numbers(product), numbers(b));
    return b;
  };
  const Eigen::VectorXd b = right_hand_side(all, u);

  int rows = 0;
  for (int third = 0; third < 3; ++third) {
    const Part part(whole, support, third, support[0]);
    const auto in_part = [&](const std::vector<int>& points, bool own) {
      std::vector<int> found;
      for (int k = 0; k < part.cloud.size(); ++k)
        if (std::ranges::binary_search(points, part.number(k)) &&
            (!own || std::ranges::binary_search(part.rows, k)))
          found.push_back(k);
      return found;
    };
    DiffusionOptions some = options;
    some.source = source(part.points);
    DiffusionSystem system(part.cloud,
                           with_conductivity(assemble("laplacian-mixed-soc", part.cloud, part.near,
                                                      {.rows = part.rows}),
                                             kappa(part.points)),
                           {.fixed = {in_part(left, false)},
                            .walls = walls(part.cloud, part.near, in_part(right, true))},
                           some);
    const Eigen::VectorXd some_b = right_hand_side(system, u(part.points));
    std::vector<int> names;  // of the part's unknowns among all
    for (const int k : system.columns())
      names.push_back(static_cast<int>(std::ranges::find(all.columns(), part.number(k)) -
                                       all.columns().begin()));
    for (std::size_t k = 0; k < system.rows().size(); ++k, ++rows) {
      const int i = part.number(system.rows()[k]);
      const auto row = static_cast<int>(std::ranges::find(all.rows(), i) - all.rows().begin());
      expect_same_row(system.matrix(), static_cast<int>(k), names, all.matrix(), row);
      EXPECT_NEAR(some_b[k], b[row], 1e-13 * b.cwiseAbs().maxCoeff());  // products' own rounding
    }
  }
  EXPECT_EQ(rows, all.matrix().rows());
}

TEST(PartOfACloud, TakesNumbersOfTheRightSizeOnly) {
  const Cloud whole = irregular_cloud(2, 8);
  const Operator psi =
      assemble("laplacian-mixed-zoc", whole, find_neighbours(whole, rich_support(whole)));
  DiffusionSystem system(whole, psi, {.fixed = {{3, 4}}}, {.time_step = 1, .theta = 0.5});
  std::vector<double> u(whole.size()), few(whole.size() - 2), fewer(whole.size() - 3);
  system.right_hand_side(u, few, few);
  EXPECT_THROW(system.right_hand_side(few, few, few), InvalidInput);
  EXPECT_THROW(system.right_hand_side(u, fewer, few), InvalidInput);
  EXPECT_THROW(system.right_hand_side(u, few, fewer), InvalidInput);
  EXPECT_THROW(system.set_fixed(few), InvalidInput);
  SparseMatrix other = psi.matrix(), own = system.take_matrix();
  EXPECT_EQ(system.matrix().nonZeros(), 0);
  EXPECT_THROW(system.set_time_step(2, other), InvalidInput);
  const double diagonal = own.coeff(0, 0);
  system.set_time_step(2, own);
  EXPECT_NEAR(own.coeff(0, 0), diagonal - 0.5, 1e-12 * diagonal);
}

TEST(PartOfACloud, IsNoSystemThatOneProcessCanSolve) {
  const Cloud whole = irregular_cloud(2, 8);
  const Operator part = assemble("laplacian-mixed-zoc", whole,
                                 find_neighbours(whole, rich_support(whole)), {.rows = {{4, 5}}});
  EXPECT_THAT(
      message_of<InvalidInput>([&] { ImplicitDiffusion(whole, part, {}, {.time_step = 1}); }),
      testing::HasSubstr("has 2 rows that were asked for"));
}

TEST(PartOfACloud, IsNamedByTheNumbersOfTheWhole) {
  const Positions x{{0.0, 0.0}, {1.0, 0.0}, {1.0, 0.0}, {0.5, 0.5}};
  const Cloud part(x, {.numbers = {7, 1'000'000'000'000, 1'000'000'000'001, 12}});
  EXPECT_EQ(part.number(3), 12);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(part, 0.9); }),
              testing::HasSubstr("points 1000000000000 and 1000000000001 coincide"));
  const Cloud apart(x.topRows(2), {.numbers = {7, 9}});
  EXPECT_THAT(message_of<StencilError>(
                  [&] { assemble("laplacian-mixed-soc", apart, find_neighbours(apart, 1.5)); }),
              testing::HasSubstr("at point 7"));
  EXPECT_THROW(Cloud(x, {.numbers = {1, 2}}), InvalidInput);
}

}  // namespace
}  // namespace gradpsi
