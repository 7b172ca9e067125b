// Rows that cannot be solved, and what becomes of them.

#include <algorithm>
#include <cmath>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;

class Fault02Point : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
  int points_per_side() const { return dimension() == 1 ? 40 : dimension() == 2 ? 11 : 6; }
};

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

INSTANTIATE_TEST_SUITE_P(Assemble, Fault02Point, compact_schemes_and_dimensions(), case_name);

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

TEST(Require, SaysWhatFailSaysOfTheRowsThatAreNeeded) {
  const Cloud cloud = collinear(2);
  const Neighbours near = find_neighbours(cloud, 0.3);
  const Scheme scheme = "laplacian-mixed-soc";
  const Operator op = assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Zero});
  std::vector<int> needed = {4, 7, 21}, others;
  for (int i = 29; i >= 0; --i)
    if (std::ranges::find(needed, i) == needed.end()) others.push_back(i);
  EXPECT_EQ(message_of<StencilError>([&] { require(scheme, cloud, op, others); }),
            message_of<StencilError>([&] { assemble(scheme, cloud, near, {.rows = needed}); }));
  others.insert(others.end(), needed.begin(), needed.end());
  EXPECT_NO_THROW(require(scheme, cloud, op, others));
}

TEST(Fault07, CollinearPointsHaveSingularSystems) {
  for (const int d : {2, 3}) {
    const Cloud cloud = collinear(d);
    const Neighbours near = find_neighbours(cloud, 0.3);
    for (const Scheme& scheme : schemes()) {
      if (degree(scheme) <= 0) {
        EXPECT_NO_THROW(assemble(scheme, cloud, near));
        continue;
      }
      EXPECT_THAT(message_of<StencilError>([&] { assemble(scheme, cloud, near); }),
                  HasSubstr("30 of 30 rows are degenerate"))
          << name(scheme);
      const Operator lowered =
          assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Lower});
      // Without correction diffuse-ns has no Hessian.
      const bool none =
          scheme.derivative == Derivative::Hessian && scheme.weight == Weight::DiffuseNs;
      EXPECT_THAT(lowered.rows.outcome, Each(none ? RowOutcome::Zero : RowOutcome::Lowered))
          << name(scheme);
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
    EXPECT_STREQ(error.what(),
                 "laplacian-mixed-soc cannot be computed at point 0: at least 5 neighbours are "
                 "needed (4 neighbours, reciprocal condition number 0, at (0, 0)); 5 of 5 rows are "
                 "degenerate");
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
    const int q = order(scheme.derivative);
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

TEST(Lower, GoesDownDegreeByDegree) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 12, .jitter = 0.1});
  const Operator op = assemble("laplacian-ls-6", cloud, find_neighbours(cloud, 4.4 / 12),
                               {.on_degenerate = OnDegenerate::Lower});
  EXPECT_GE(op.rows.degree.minCoeff(), 3);
  EXPECT_GE(op.rows.degree.maxCoeff(), 5);
  for (const int P : {3, 4, 5}) {
    const Operator lower =
        assemble("laplacian-ls-" + std::to_string(P), cloud, find_neighbours(cloud, 4.4 / 12),
                 {.on_degenerate = OnDegenerate::Lower});
    for (int i = 0; i < cloud.size(); ++i)
      if (op.rows.degree[i] == P) {
        // Lowered rows are solved one at a time; the systems' condition is up to 1e9.
        const Eigen::RowVectorXd row = lower.matrix().row(i);
        EXPECT_LT((op.matrix().row(i) - row).norm(), 1e-7 * row.norm());
      }
  }
}

// Found by a fuzzer: a row without conditions whose system is nearly singular was checked for those it has not.
TEST(NormalizedGradient, OfPointsNearlyInAPlaneIsChecked) {
  Positions x = irregular_cloud(3, 6).positions();
  x.col(2) *= 1e-8;
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Ones(x.rows())});
  const Operator op = assemble("gradient-normalized", cloud, find_neighbours(cloud, 0.3),
                               {.on_degenerate = OnDegenerate::Zero});
  EXPECT_LT(op.rows.reciprocal_condition.minCoeff(), 1e-12);
  for (const SparseMatrix& A : op.axes) EXPECT_TRUE(A.coeffs().isFinite().all());
}

TEST(TwoPassLaplacian, HasTheSameRowsAloneWhateverThePolicy) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 1.15 * cloud.spacing());
  for (const OnDegenerate policy : {OnDegenerate::Zero, OnDegenerate::Lower, OnDegenerate::Widen}) {
    const Operator all = assemble("laplacian-kgf", cloud, near, {.on_degenerate = policy});
    EXPECT_GT(all.rows.degenerate(), 0);
    const std::vector<int> rows = {3, 70, 12};
    const Operator some =
        assemble("laplacian-kgf", cloud, near, {.on_degenerate = policy, .rows = rows});
    for (int k = 0; k < 3; ++k) {
      const Eigen::RowVectorXd row = some.matrix().row(k), expected = all.matrix().row(rows[k]);
      EXPECT_EQ(row, expected) << k;
      EXPECT_EQ(some.rows.outcome[k], all.rows.outcome[rows[k]]) << k;
    }
  }
}

TEST(TwoPassLaplacian, FailsWhereARowThatItIsMadeOfDoes) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 1.15 * cloud.spacing());
  const Operator zero =
      assemble("laplacian-kgf", cloud, near, {.on_degenerate = OnDegenerate::Zero});
  std::vector<int> computed;
  for (int i = 0; i < cloud.size(); ++i)
    if (zero.rows.outcome[i] == RowOutcome::AsAsked) computed.push_back(i);
  EXPECT_GT(computed.size(), 0);
  const Operator some = assemble("laplacian-kgf", cloud, near, {.rows = computed});
  for (std::size_t k = 0; k < computed.size(); ++k)
    EXPECT_EQ(Eigen::RowVectorXd(some.matrix().row(k)),
              Eigen::RowVectorXd(zero.matrix().row(computed[k])));
  EXPECT_THAT(message_of<StencilError>([&] { assemble("laplacian-kgf", cloud, near); }),
              AllOf(HasSubstr("laplacian-kgf cannot be computed at point"),
                    HasSubstr("a row of gradient-mls-1 that it is made of cannot be"),
                    HasSubstr(std::to_string(zero.rows.degenerate()) + " of 144 rows")));
}

}  // namespace
}  // namespace gradpsi
