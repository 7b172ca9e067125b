#include <cmath>
#include <limits>

#include "clouds.hpp"
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
    EXPECT_NEAR(op.rows.reciprocal_condition[i] / expected.reciprocal_condition, 1, relative);
    for (Eigen::Index a = 0; a < expected.weights.rows(); ++a) {
      const Eigen::RowVectorXd difference =
          expected.weights.row(a) - Eigen::RowVectorXd(op.axes[a].row(i));
      EXPECT_LT(difference.cwiseAbs().maxCoeff(), relative * expected.weights.cwiseAbs().maxCoeff())
          << kernel.name << " point " << i << " axis " << a;
    }
  }
}

TEST_P(AllSchemes, AgreesWithTheLiteralFormula) {
  const Cloud cloud = irregular_cloud(dimension(), points_per_side(), 7);
  for (const Kernel& k : kernels())
    expect_agreement(scheme(), cloud, Eigen::VectorXd::Constant(1, rich_support(cloud)), k);
}

TEST_P(AllSchemes, AgreesWithTheLiteralFormulaInAPeriodicBoxWithOneSupportPerRow) {
  const Cloud cloud = periodic(irregular_cloud(dimension(), points_per_side(), 8));
  expect_agreement(scheme(), cloud, uneven_supports(cloud), kernels().front());
}

TEST_P(AllSchemes, StoresSortedCompressedRowsWithTheDiagonal) {
  const Cloud cloud = irregular_cloud(dimension(), points_per_side());
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator op = assemble(scheme(), cloud, near);
  EXPECT_EQ(op.axes.size(), scheme().derivative == Derivative::Gradient ? dimension() : 1u);
  for (const SparseMatrix& matrix : op.axes) {
    EXPECT_TRUE(matrix.isCompressed());
    EXPECT_EQ(matrix.nonZeros(), near.indices.size() + cloud.size());
    for (int i = 0; i < matrix.rows(); ++i) {
      bool diagonal = false;
      int last = -1;
      for (SparseMatrix::InnerIterator entry(matrix, i); entry; ++entry) {
        EXPECT_GT(entry.col(), last);
        last = static_cast<int>(entry.col());
        diagonal |= last == i;
      }
      EXPECT_TRUE(diagonal);
      EXPECT_EQ(op.rows.neighbours[i], near.count(i));
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
                                                                      : 13);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  const Operator one = assemble(scheme(), cloud, near, {.threads = 1});
  for (const int threads : {2, 3}) {
    const Operator many = assemble(scheme(), cloud, near, {.threads = threads});
    for (std::size_t a = 0; a < one.axes.size(); ++a)
      EXPECT_TRUE(std::equal(one.axes[a].valuePtr(),
                             one.axes[a].valuePtr() + one.axes[a].nonZeros(),
                             many.axes[a].valuePtr()));
  }
}

class Fault01Points : public AllSchemes {};
TEST_P(Fault01Points, NoneGiveAnEmptyMatrix) {
  const Cloud none(Positions(0, dimension()));
  const Operator op = assemble(scheme(), none, find_neighbours(none, 1.0));
  EXPECT_EQ(op.matrix().rows(), 0);
  EXPECT_EQ(op.matrix().cols(), 0);
}

class Fault02Point : public AllSchemes {};
TEST_P(Fault02Point, WithoutNeighboursIsHandledByPolicy) {
  Positions x = irregular_cloud(dimension(), points_per_side()).positions();
  x.row(5).setConstant(40);
  const Cloud cloud(x);
  const Neighbours near = find_neighbours(cloud, 3.4 / points_per_side());
  try {
    assemble(scheme(), cloud, near);
    FAIL() << "expected StencilError";
  } catch (const StencilError& error) {
    EXPECT_EQ(error.point, 5);
    EXPECT_EQ(error.neighbours, 0);
    EXPECT_THAT(error.what(), HasSubstr("at point 5: it has no neighbour"));
  }
  for (const auto policy : {OnDegenerate::Lower, OnDegenerate::Zero}) {
    const Operator op = assemble(scheme(), cloud, near, {.on_degenerate = policy});
    EXPECT_EQ(op.rows.degenerate(), 1);
    EXPECT_EQ(op.rows.outcome[5], RowOutcome::Zero);
    for (const auto& matrix : op.axes) {
      EXPECT_EQ(matrix.row(5).nonZeros(), 1);
      EXPECT_EQ(matrix.coeff(5, 5), 0);
      EXPECT_FALSE(std::signbit(matrix.coeff(5, 5)));
      EXPECT_TRUE(matrix.coeffs().isFinite().all());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Assemble, AllSchemes, compact_schemes_and_dimensions(), case_name);
INSTANTIATE_TEST_SUITE_P(Assemble, Fault01Points, compact_schemes_and_dimensions(), case_name);
INSTANTIATE_TEST_SUITE_P(Assemble, Fault02Point, compact_schemes_and_dimensions(), case_name);
INSTANTIATE_TEST_SUITE_P(Assemble, Fault11Threads, compact_schemes_and_dimensions(), case_name);

Cloud points(int dimension, std::initializer_list<double> coordinates) {
  Positions x(static_cast<Eigen::Index>(coordinates.size()) / dimension, dimension);
  std::copy(coordinates.begin(), coordinates.end(), x.data());
  return Cloud(x, {.volumes = Eigen::VectorXd::Ones(x.rows())});
}

TEST(Fault02, OnePointIsADegenerateRow) {
  const Cloud one = points(2, {0.5, 0.5});
  const Neighbours near = find_neighbours(one, 1.0);
  for (const Scheme& scheme : schemes()) {
    EXPECT_THROW(assemble(scheme, one, near), StencilError);
    const Operator op = assemble(scheme, one, near, {.on_degenerate = OnDegenerate::Zero});
    EXPECT_EQ(op.matrix().coeff(0, 0), 0);
  }
}

/// Thirty points on a slanted line, with rounding, in d dimensions.
Cloud collinear(int dimension) {
  Positions x(30, dimension);
  for (int i = 0; i < 30; ++i)
    for (int a = 0; a < dimension; ++a) x(i, a) = 0.1 * a + (0.3 + 0.17 * a) * i / 30;
  return Cloud(x);
}

TEST(Fault07, CollinearPointsHaveSingularSystems) {
  for (const int d : {2, 3}) {
    const Cloud cloud = collinear(d);
    const Neighbours near = find_neighbours(cloud, 0.3);
    for (const Scheme& scheme : schemes()) {
      if (scheme.consistency == Consistency::Zoc) {
        EXPECT_NO_THROW(assemble(scheme, cloud, near));
        continue;
      }
      EXPECT_THAT(message_of<StencilError>([&] { assemble(scheme, cloud, near); }),
                  HasSubstr("30 of 30 rows are degenerate"))
          << name(scheme);
      const Operator lowered =
          assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Lower});
      EXPECT_THAT(lowered.rows.outcome, Each(RowOutcome::Lowered)) << name(scheme);
      const Operator zero = assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Zero});
      EXPECT_THAT(zero.rows.outcome, Each(RowOutcome::Zero));
      EXPECT_EQ(zero.matrix().norm(), 0);
    }
  }
}

TEST(Fault07, CoplanarPointsInThreeDimensionsHaveSingularSystems) {
  Positions x(64, 3);
  x.leftCols<2>() = irregular_cloud(2, 8).positions();
  x.col(2) = 0.3 * x.col(0) - 0.7 * x.col(1);
  const Cloud cloud(x);
  const Neighbours near = find_neighbours(cloud, 0.5);
  for (const char* scheme : {"gradient-direct-foc", "gradient-diffuse-soc", "laplacian-mixed-soc"})
    EXPECT_THAT(message_of<StencilError>([&] { assemble(scheme, cloud, near); }),
                HasSubstr("64 of 64 rows are degenerate"));
}

// All points on a circle: first-order terms are determined, second-order ones are not.
TEST(Fault07, PointsOnACircleAreLoweredToFirstOrder) {
  Positions x(13, 2);
  for (int k = 0; k < 13; ++k)
    x.row(k) << 0.3 + 0.4 * std::cos(0.1 + 0.48 * k), 0.4 * std::sin(0.1 + 0.48 * k);
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Ones(13)});
  const Neighbours near = find_neighbours(cloud, 0.9);
  const AssemblyOptions lower{.on_degenerate = OnDegenerate::Lower};
  const Operator asked = assemble("gradient-direct-soc", cloud, near, lower);
  EXPECT_THAT(asked.rows.outcome, Each(RowOutcome::Lowered));
  EXPECT_TRUE((asked.rows.degree.array() == 1).all());
  EXPECT_LT(asked.rows.reciprocal_condition.maxCoeff(), singular_below);
  const Operator foc = assemble("gradient-direct-foc", cloud, near, lower);
  for (int a = 0; a < 2; ++a)  // lowered rows are solved one at a time
    EXPECT_LT(SparseMatrix(asked.axes[a] - foc.axes[a]).norm(), 1e-14 * foc.axes[a].norm());
}

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

TEST(Fault17, FewerNeighboursThanUnknownsNamesThePointAndItsNeighbours) {
  // Point 0 has four neighbours; a second-order row has five unknowns.
  const Cloud cross = points(2, {0, 0, 1, 0, -1, 0.1, 0, 1, 0.2, -1});
  const Neighbours near = find_neighbours(cross, 1.2);
  try {
    assemble("laplacian-mixed-soc", cross, near);
    FAIL() << "expected StencilError";
  } catch (const StencilError& error) {
    EXPECT_EQ(error.point, 0);
    EXPECT_EQ(error.neighbours, 4);
    EXPECT_EQ(error.reciprocal_condition, 0);
    EXPECT_STREQ(
        error.what(),
        "laplacian-mixed-soc cannot be computed at point 0: at least 5 neighbours are "
        "needed (4 neighbours, reciprocal condition number 0); 5 of 5 rows are degenerate");
  }
}

TEST(Fault18, AWeightThatIsNotFiniteIsNeverStored) {
  // Volumes and support of ordinary size for their unit, but 1/h^2 is beyond a double.
  Positions x = irregular_cloud(2, 8).positions() * 1e-170;
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(64, 1e-300)});
  const Neighbours near = find_neighbours(cloud, 0.4e-170);
  EXPECT_THAT(message_of<StencilError>([&] { assemble("laplacian-mixed-soc", cloud, near); }),
              HasSubstr("its weights are not finite"));
  const Operator zero =
      assemble("laplacian-mixed-soc", cloud, near, {.on_degenerate = OnDegenerate::Lower});
  EXPECT_TRUE(zero.matrix().coeffs().isFinite().all());
}

// Where 1/h^2 is a double, at 1e-150 and 1e150, entries are what the unit of length makes of them; where it
// is none, an error says so.
TEST(Fault08, CoordinatesOfAnySizeGiveTheirMatrixOrAnError) {
  const Cloud cloud = irregular_cloud(1, 40);
  const auto assembled = [&](const Scheme& scheme, double unit) {
    const Cloud scaled(cloud.positions() * unit, {.volumes = cloud.volumes() * unit});
    return assemble(scheme, scaled, find_neighbours(scaled, 0.1 * unit)).matrix();
  };
  for (const Scheme& scheme : {Scheme("gradient-direct-soc"), Scheme("gradient-diffuse-zoc"),
                               Scheme("laplacian-mixed-soc"), Scheme("laplacian-diffuse-zoc")}) {
    const int q = scheme.derivative == Derivative::Gradient ? 1 : 2;
    const SparseMatrix expected = assembled(scheme, 1);
    for (const int exponent : {-500, 500, q == 1 ? -660 : 510, q == 1 ? 660 : -500}) {
      SparseMatrix found = assembled(scheme, std::ldexp(1.0, exponent));
      for (int k = 0; k < q; ++k) found *= std::ldexp(1.0, exponent);
      // The smallest entries lose digits where the largest are near the end of the range.
      EXPECT_LT(SparseMatrix(found - expected).norm(), 1e-14 * expected.norm())
          << name(scheme) << " " << exponent;
    }
    if (q == 2) {
      EXPECT_THAT(message_of<InvalidInput>([&] { assembled(scheme, 1e200); }),
                  HasSubstr("of a laplacian, about 1/support^2, are below the range of a double"));
      EXPECT_THAT(message_of<StencilError>([&] { assembled(scheme, 1e-200); }),
                  HasSubstr("its weights are not finite"));
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
