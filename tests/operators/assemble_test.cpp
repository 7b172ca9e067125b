#include "clouds.hpp"
#include "derivatives.hpp"
#include "oracle.hpp"

namespace gradpsi {
namespace {

using testing::Each;
using testing::HasSubstr;

class AllSchemes : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
  int points_per_side() const { return dimension() == 1 ? 40 : dimension() == 2 ? 11 : 6; }
};

void expect_agreement(const Scheme& scheme, const Cloud& cloud, const Eigen::VectorXd& supports,
                      const Kernel& kernel) {
  const Neighbours near = find_neighbours(cloud, supports);
  const Operator op = assemble(scheme, cloud, near, {.kernel = kernel});
  for (int i = 0; i < cloud.size(); i += 7) {
    const OracleRow expected = oracle_row(scheme, cloud, near.support(i), i, kernel);
    ASSERT_EQ(expected.weights.rows(), static_cast<Eigen::Index>(op.axes.size()));
    // Rounding grows with the condition of the row's moment system.
    const double relative = 1e-14 / expected.reciprocal_condition;
    if (!is_cited(scheme)) {
      EXPECT_NEAR(op.rows.reciprocal_condition[i] / expected.reciprocal_condition, 1, relative);
    }
    for (Eigen::Index a = 0; a < expected.weights.rows(); ++a) {
      const Eigen::RowVectorXd difference =
          expected.weights.row(a) - Eigen::RowVectorXd(op.axes[a].row(i));
      EXPECT_LT(difference.cwiseAbs().maxCoeff(), relative * expected.weights.cwiseAbs().maxCoeff())
          << kernel.name << " point " << i << " axis " << a;
    }
  }
}

TEST_P(AllSchemes, AgreesWithTheLiteralFormula) {
  if (!has_oracle(scheme())) GTEST_SKIP();
  const Cloud cloud = irregular_cloud(dimension(), points_per_side(), 7);
  for (const Kernel& k : kernels())
    expect_agreement(scheme(), cloud, Eigen::VectorXd::Constant(1, rich_support(cloud)), k);
}

TEST_P(AllSchemes, AgreesWithTheLiteralFormulaInAPeriodicBoxWithOneSupportPerRow) {
  if (!has_oracle(scheme())) GTEST_SKIP();
  const Cloud cloud = periodic(irregular_cloud(dimension(), points_per_side(), 8));
  expect_agreement(scheme(), cloud, uneven_supports(cloud), kernels().front());
}

TEST_P(AllSchemes, StoresSortedCompressedRowsWithTheDiagonal) {
  const Cloud cloud = irregular_cloud(dimension(), points_per_side());
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator op = assemble(scheme(), cloud, near);
  EXPECT_EQ(op.axes.size(), partials(scheme().derivative, dimension()).size());
  for (const SparseMatrix& matrix : op.axes) {
    EXPECT_TRUE(matrix.isCompressed());
    if (scheme().consistency != Consistency::Kgf) {
      EXPECT_EQ(matrix.nonZeros(), near.indices.size() + cloud.size());
    }
    for (int i = 0; i < matrix.rows(); ++i) {
      bool diagonal = false;
      int last = -1;
      for (SparseMatrix::InnerIterator entry(matrix, i); entry; ++entry) {
        EXPECT_GT(entry.col(), last);
        last = static_cast<int>(entry.col());
        diagonal |= last == i;
      }
      EXPECT_TRUE(diagonal);
      EXPECT_EQ(op.rows.neighbours[i], matrix.row(i).nonZeros() - 1);
    }
  }
  EXPECT_THAT(op.rows.outcome, Each(RowOutcome::AsAsked));
  EXPECT_EQ(op.rows.degenerate(), 0);
}

TEST_P(AllSchemes, ASubsetOfRowsEqualsRowsOfTheWhole) {
  const Cloud cloud = irregular_cloud(dimension(), points_per_side());
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator whole = assemble(scheme(), cloud, near);
  const std::vector<int> rows = {17, 3, 3, 30, 0};
  const Operator part = assemble(scheme(), cloud, near, {.rows = rows});
  for (std::size_t a = 0; a < whole.axes.size(); ++a) {
    ASSERT_EQ(part.axes[a].rows(), 5);
    ASSERT_EQ(part.axes[a].cols(), cloud.size());
    for (int k = 0; k < 5; ++k)
      EXPECT_EQ(Eigen::RowVectorXd(part.axes[a].row(k)),
                Eigen::RowVectorXd(whole.axes[a].row(rows[k])));
  }
  for (int k = 0; k < 5; ++k)
    EXPECT_EQ(part.rows.reciprocal_condition[k], whole.rows.reciprocal_condition[rows[k]]);
}

class Fault11Threads : public AllSchemes {};

TEST_P(Fault11Threads, DoNotChangeABit) {
  const Cloud cloud = irregular_cloud(dimension(), dimension() == 1   ? 3000
                                                   : dimension() == 2 ? 50
                                                                      : 11);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator one = assemble(scheme(), cloud, near, {.threads = 1}),
                 many = assemble(scheme(), cloud, near, {.threads = 3});
  for (std::size_t a = 0; a < one.axes.size(); ++a)
    EXPECT_TRUE(std::equal(one.axes[a].valuePtr(), one.axes[a].valuePtr() + one.axes[a].nonZeros(),
                           many.axes[a].valuePtr()));
}

class Fault01Points : public AllSchemes {};

TEST_P(Fault01Points, NoneGiveAnEmptyMatrix) {
  const Cloud none(Positions(0, dimension()));
  const Operator op = assemble(scheme(), none, find_neighbours(none, 1.0));
  EXPECT_EQ(op.matrix().rows(), 0);
  EXPECT_EQ(op.matrix().cols(), 0);
}

INSTANTIATE_TEST_SUITE_P(Assemble, AllSchemes, compact_schemes_and_dimensions(), case_name);

INSTANTIATE_TEST_SUITE_P(Assemble, Fault01Points, compact_schemes_and_dimensions(), case_name);

INSTANTIATE_TEST_SUITE_P(Assemble, Fault11Threads, compact_schemes_and_dimensions(), case_name);

// A unit square 1e8 units away: only differences of coordinates enter, and those are the same.
TEST(Fault09, AFarOriginChangesNothing) {
  for (const int d : {1, 2, 3}) {
    // Multiples of 2^-20, so that 1e8 can be added to them exactly.
    const Cloud irregular = irregular_cloud(d, d == 3 ? 6 : 12);
    const Positions x = (irregular.positions() * 0x1p20).array().round() * 0x1p-20;
    const double support = 0.45;
    for (const double box : {0.0, 1.0}) {
      CloudOptions options{.volumes = irregular.volumes()};
      std::fill_n(options.box.begin(), d, box);
      const Cloud here(x, options), there(x.array() + 1e8, options);
      const Neighbours near = find_neighbours(here, support), far = find_neighbours(there, support);
      EXPECT_EQ(near.indices, far.indices);
      for (const Scheme& scheme : compact_schemes(1)) {
        const Operator a = assemble(scheme, here, near), b = assemble(scheme, there, far);
        for (std::size_t axis = 0; axis < a.axes.size(); ++axis)
          EXPECT_EQ(SparseMatrix(a.axes[axis] - b.axes[axis]).norm(), 0) << name(scheme);
      }
    }
  }
}

TEST(Fault19, RowsWithTooManyEntriesAreRefused) {
  const Cloud line = make_cloud(Lattice{.dimension = 1, .points_per_side = 2000});
  const Neighbours near = find_neighbours(line, 2.0);  // 2,000 entries a row
  EXPECT_THAT(message_of<InvalidInput>([&] {
                assemble("gradient-direct-zoc", line, near,
                         {.rows = std::vector<int>(1'100'000, 0)});
              }),
              HasSubstr("2200000000 entries, more than 2^31 - 1"));
}

TEST(Assemble, SchemesOutsideTheTablesAreRefused) {
  const Cloud cloud = irregular_cloud(2, 6);
  const Neighbours near = find_neighbours(cloud, 0.6);
  for (const Scheme& scheme : {Scheme(Derivative::Laplacian, Weight::Mixed, Consistency::Foc),
                               Scheme(Derivative::Gradient, Weight::Mixed, Consistency::Zoc)}) {
    EXPECT_THROW(assemble(scheme, cloud, near), InvalidInput);
    EXPECT_THROW(formula(scheme), InvalidInput);
  }
}

TEST(Assemble, SizesAndRowsAreChecked) {
  const Cloud cloud = irregular_cloud(2, 6);
  const Neighbours near = find_neighbours(irregular_cloud(2, 5), 0.6);
  EXPECT_THAT(message_of<InvalidInput>([&] { assemble("gradient-direct-foc", cloud, near); }),
              HasSubstr("25 points, the cloud has 36"));
  Neighbours own = find_neighbours(cloud, 0.6);
  for (const int bad : {-1, 36})
    EXPECT_THROW(assemble("gradient-direct-foc", cloud, own, {.rows = std::vector<int>{0, bad}}),
                 InvalidInput);
  EXPECT_THROW(assemble("gradient-direct-foc", cloud, own, {.threads = -2}), InvalidInput);
  own.supports = Eigen::VectorXd::Constant(35, 0.6);
  EXPECT_THROW(assemble("gradient-direct-foc", cloud, own), InvalidInput);
}

TEST(Assemble, WithoutVolumesTheNumberDensityIsUsed) {
  const Positions x = irregular_cloud(2, 9).positions();
  const Cloud bare(x);
  const Neighbours near = find_neighbours(bare, 0.3);
  const Cloud dense(x, {.volumes = number_density_volumes(bare, near)});
  EXPECT_EQ(SparseMatrix(assemble("laplacian-mixed-zoc", bare, near).matrix() -
                         assemble("laplacian-mixed-zoc", dense, near).matrix())
                .norm(),
            0);
}

TEST(Assemble, AKernelOfOnesOwnIsARow) {
  // (1-q)^3 in two dimensions: 2 pi s times the integral of q (1-q)^3, 1/20, is one.
  const Kernel cone{"cone",
                    "(1-q)^3",
                    [](double q) {
                      const double t = 1 - q;
                      return Profile{t * t * t, q > 0 ? -3 * t * t / q : 0, 6 * t};
                    },
                    {2, 10 / 3.14159265358979, 1}};
  const Cloud cloud = irregular_cloud(2, 9);
  const Neighbours near = find_neighbours(cloud, 0.35);
  const Operator op = assemble("gradient-diffuse-foc", cloud, near, {.kernel = cone});
  const Eigen::VectorXd u = cloud.positions() * Eigen::Vector2d(2, -3);
  EXPECT_LT((op.axes[0] * u - Eigen::VectorXd::Constant(81, 2)).norm(), 1e-11);
  EXPECT_LT((op.axes[1] * u - Eigen::VectorXd::Constant(81, -3)).norm(), 1e-11);
}

TEST(Assemble, AnIncompleteKernelIsRefused) {
  const Cloud cloud = irregular_cloud(2, 6);
  const Neighbours near = find_neighbours(cloud, 0.6);
  EXPECT_THAT(message_of<InvalidInput>(
                  [&] { assemble("laplacian-mixed-zoc", cloud, near, {.kernel = Kernel{}}); }),
              HasSubstr("has no profile"));
  Kernel flat = kernels().front();
  flat.normalisation = {1, 0, 1};
  EXPECT_THAT(message_of<InvalidInput>(
                  [&] { assemble("laplacian-mixed-zoc", cloud, near, {.kernel = flat}); }),
              HasSubstr("no normalisation in 2 dimensions"));
}

TEST(Assemble, OneSupportPerRowEqualsThatRowWithItsSupportForAll) {
  const Cloud cloud = irregular_cloud(2, 10);
  const Eigen::VectorXd supports = Eigen::VectorXd::LinSpaced(100, 0.31, 0.45);
  const Operator op = assemble("laplacian-mixed-soc", cloud, find_neighbours(cloud, supports));
  for (const int i : {0, 41, 99}) {
    const Operator single =
        assemble("laplacian-mixed-soc", cloud, find_neighbours(cloud, supports[i]));
    EXPECT_EQ(Eigen::RowVectorXd(op.matrix().row(i)), Eigen::RowVectorXd(single.matrix().row(i)));
  }
}

TEST(Assemble, SeveralSchemesInOnePassAreTheSameAsOneByOne) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(d, d == 3 ? 8 : 20);
    const Neighbours near = find_neighbours(cloud, rich_support(cloud));
    std::vector<Scheme> schemes = compact_schemes();
    schemes.emplace_back("laplacian-positive");
    const AssemblyOptions options{.on_degenerate = OnDegenerate::Lower};
    const auto together = assemble(schemes, cloud, near, options);
    for (std::size_t k = 0; k < schemes.size(); ++k) {
      const Operator alone = assemble(schemes[k], cloud, near, options);
      ASSERT_EQ(together[k].axes.size(), alone.axes.size());
      for (std::size_t a = 0; a < alone.axes.size(); ++a)
        EXPECT_LT(SparseMatrix(together[k].axes[a] - alone.axes[a]).norm(),
                  1e-14 * alone.axes[a].norm())
            << name(schemes[k]);
      EXPECT_EQ(together[k].rows.outcome, alone.rows.outcome);
      EXPECT_EQ(together[k].rows.reciprocal_condition, alone.rows.reciprocal_condition);
    }
  }
  EXPECT_TRUE(assemble(std::vector<Scheme>{}, irregular_cloud(2, 5), {}).empty());
}

TEST(Reassemble, GivesWhatAssembleGives) {
  const Cloud cloud = irregular_cloud(2, 20);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  // Points that move a little within one neighbour list, in a support that they do not leave.
  Positions moved = cloud.positions();
  for (int i = 0; i < cloud.size(); ++i) moved(i, 0) += 1e-3 * cloud.spacing() * (i % 7);
  const Cloud after(moved, {.volumes = cloud.volumes()});
  for (const std::optional<std::vector<int>>& rows :
       {std::optional<std::vector<int>>(), std::optional(std::vector<int>{7, 3, 3, 100})}) {
    const AssemblyOptions options{.rows = rows};
    Operator op = assemble("laplacian-diffuse-soc", cloud, near, options);
    const double* const values = op.matrix().valuePtr();
    reassemble("laplacian-mixed-soc-ls", after, near, op, options);
    EXPECT_EQ(op.matrix().valuePtr(), values);  // in place
    const Operator anew = assemble("laplacian-mixed-soc-ls", after, near, options);
    EXPECT_EQ(SparseMatrix(op.matrix() - anew.matrix()).norm(), 0);
    EXPECT_EQ(op.rows.reciprocal_condition, anew.rows.reciprocal_condition);
  }
}

TEST(Reassemble, SeveralInOnePassAreTheSameAsOneByOne) {
  const Cloud cloud = irregular_cloud(2, 20);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  Positions moved = cloud.positions();
  moved.col(1) *= 1.02;
  const Cloud after(moved, {.volumes = cloud.volumes()});
  const std::vector<Scheme> schemes = {"gradient-ls-2", "laplacian-ls-2", "gradient-direct-zoc"};
  std::vector<Operator> together = assemble(schemes, cloud, near);
  const double* const values = together[1].matrix().valuePtr();
  reassemble(schemes, after, near, together);
  EXPECT_EQ(together[1].matrix().valuePtr(), values);  // in place
  const std::vector<Operator> anew = assemble(schemes, after, near);
  for (std::size_t k = 0; k < schemes.size(); ++k) {
    for (std::size_t a = 0; a < anew[k].axes.size(); ++a)
      EXPECT_EQ(SparseMatrix(together[k].axes[a] - anew[k].axes[a]).norm(), 0);
    EXPECT_EQ(together[k].rows.reciprocal_condition, anew[k].rows.reciprocal_condition);
  }
  together.pop_back();
  EXPECT_THAT(message_of<InvalidInput>([&] { reassemble(schemes, after, near, together); }),
              HasSubstr("3 schemes are for as many operators, not 2"));
}

TEST(Reassemble, RefusesAnotherPattern) {
  const Cloud cloud = irregular_cloud(2, 10);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Neighbours fewer = find_neighbours(cloud, 0.8 * rich_support(cloud));
  Operator op = assemble("laplacian-mixed-zoc", cloud, near);
  const auto message = [&](const Scheme& scheme, const Neighbours& list,
                           const AssemblyOptions& options = {}) {
    return message_of<InvalidInput>([&] { reassemble(scheme, cloud, list, op, options); });
  };
  EXPECT_THAT(message("laplacian-mixed-zoc", fewer), HasSubstr("not assembled with these"));
  EXPECT_THAT(message("laplacian-mixed-zoc", near, {.rows = std::vector{1, 2}}),
              HasSubstr("not assembled with these"));
  EXPECT_THAT(message("gradient-direct-zoc", near), HasSubstr("has 2 matrices here, not 1"));
  EXPECT_THAT(message("laplacian-positive", near), HasSubstr("depends on its values"));
  EXPECT_THAT(message("laplacian-mixed-soc", near, {.on_degenerate = OnDegenerate::Widen}),
              HasSubstr("cannot be widened"));
}

}  // namespace
}  // namespace gradpsi
