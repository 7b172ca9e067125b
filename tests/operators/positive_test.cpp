// Minimal positive stencils: what they promise, and that they are minimal.

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "clouds.hpp"
#include "dense.hpp"

namespace gradpsi {
namespace {

const Scheme positive("laplacian-positive");

/// Conditions [9], [10] on weights of neighbours at s (n x d): a row each, and what they ask for.
struct Conditions {
  Eigen::MatrixXd rows;
  Eigen::VectorXd rhs;
};
Conditions conditions(const Eigen::MatrixXd& s) {
  const auto d = s.cols();
  Conditions c{Eigen::MatrixXd(d * (d + 3) / 2, s.rows()), Eigen::VectorXd::Zero(d * (d + 3) / 2)};
  c.rows.topRows(d) = s.transpose();
  Eigen::Index row = d;
  for (Eigen::Index a = 0; a < d; ++a)
    for (Eigen::Index b = a; b < d; ++b) {
      c.rows.row(row) = s.col(a).cwiseProduct(s.col(b)).transpose();
      c.rhs[row++] = a == b ? 2 : 0;
    }
  return c;
}

/// Row i's neighbours within h in units of h, and its off-diagonal weights times h^2.
struct Stencil {
  Eigen::MatrixXd s;
  Eigen::VectorXd psi;
};
Stencil stencil(const Cloud& cloud, const Neighbours& near, const SparseMatrix& matrix, int i) {
  Stencil result{Eigen::MatrixXd(near.count(i), cloud.dimension()), Eigen::VectorXd(near.count(i))};
  const double h = near.support(i);
  for (int k = 0; k < near.count(i); ++k) {
    const int j = near.of(i)[k];
    for (int a = 0; a < cloud.dimension(); ++a) {
      double r = cloud.positions()(j, a) - cloud.positions()(i, a);
      if (cloud.box()[a] > 0) r = std::remainder(r, cloud.box()[a]);
      result.s(k, a) = r / h;
    }
    result.psi[k] = matrix.coeff(i, j) * h * h;
  }
  return result;
}

Cloud cloud(int d, double jitter, bool periodic, std::uint64_t seed = 1) {
  return make_cloud(Lattice{.dimension = d,
                            .points_per_side = d == 1   ? 40
                                               : d == 2 ? 16
                                                        : 8,
                            .jitter = jitter,
                            .seed = seed,
                            .periodic = periodic});
}

TEST(Positive, MeetsItsConditionsWithFewWeightsNoneOfThemNegative) {
  for (const int d : {1, 2, 3})
    for (const double jitter : {0.0, 0.2, 0.4, 0.5})
      for (const bool periodic : {true, false}) {
        const Cloud cloud = gradpsi::cloud(d, jitter, periodic);
        const Neighbours near = find_neighbours(cloud, 3.0 * cloud.spacing());
        const Operator op = assemble(positive, cloud, near, {.on_degenerate = OnDegenerate::Zero});
        if (periodic && jitter < 0.45) {
          EXPECT_EQ(op.rows.degenerate(), 0);
        }
        for (int i = 0; i < cloud.size(); ++i) {
          const int entries = static_cast<int>(op.matrix().row(i).nonZeros());
          EXPECT_LE(entries, d * (d + 3) / 2 + 1);
          if (op.rows.outcome[i] == RowOutcome::Zero) {
            EXPECT_EQ(entries, 1);
            continue;
          }
          const auto [s, psi] = stencil(cloud, near, op.matrix(), i);
          EXPECT_GE(psi.minCoeff(), 0);
          EXPECT_EQ((psi.array() > 0).count(), entries - 1);  // nothing is kept that is zero
          const auto [rows, rhs] = conditions(s);
          EXPECT_LT((dense_product(rows, psi) - rhs).cwiseAbs().maxCoeff(), 1e-12);
          EXPECT_NEAR(op.matrix().coeff(i, i) * std::pow(near.support(i), 2), -psi.sum(),
                      1e-12 * psi.sum());
        }
      }
}

/// The least sum q^5 psi over all basic solutions of the conditions, one after the other; infinity if
/// there is none.
double least_cost(const Eigen::MatrixXd& s) {
  const auto [rows, rhs] = conditions(s);
  const int n = static_cast<int>(s.rows()), m = static_cast<int>(rhs.size());
  const Eigen::VectorXd cost = s.rowwise().norm().array().pow(5);
  double least = std::numeric_limits<double>::infinity();
  std::vector<int> chosen(m);
  std::iota(chosen.begin(), chosen.end(), 0);
  while (n >= m) {
    const Eigen::MatrixXd psi = dense_solution(rows(Eigen::all, chosen), rhs);
    if (psi.size() > 0 && psi.minCoeff() >= -1e-10)
      least = std::min(least, cost(chosen).dot(psi.col(0)));
    int k = m - 1;
    while (k >= 0 && chosen[k] == n - m + k) --k;
    if (k < 0) break;
    ++chosen[k];
    for (int l = k + 1; l < m; ++l) chosen[l] = chosen[l - 1] + 1;
  }
  return least;
}

TEST(Positive, IsTheCheapestOfAllBasicSolutions) {
  int without = 0;
  for (const int d : {1, 2})
    for (const double jitter : {0.1, 0.4}) {
      const Cloud cloud = make_cloud(
          Lattice{.dimension = d, .points_per_side = d == 1 ? 30 : 9, .jitter = jitter, .seed = 7});
      const Neighbours near = find_neighbours(cloud, 2.1 * cloud.spacing());
      const Operator op = assemble(positive, cloud, near, {.on_degenerate = OnDegenerate::Zero});
      for (int i = 0; i < cloud.size(); ++i) {
        const auto [s, psi] = stencil(cloud, near, op.matrix(), i);
        const double least = least_cost(s);
        const bool exists = std::isfinite(least);
        ASSERT_EQ(op.rows.outcome[i] == RowOutcome::AsAsked, exists) << "row " << i;
        without += !exists;
        if (!exists) continue;
        const double cost = s.rowwise().norm().array().pow(5).matrix().dot(psi);
        EXPECT_NEAR(cost / least, 1, 1e-10) << "row " << i;
      }
    }
  EXPECT_GT(without, 20);  // the boundary
}

// Six neighbours at 60 degrees have a whole family of positive solutions of one cost.
TEST(Positive, TiesDoNotDependOnTheOrderOfThePoints) {
  Positions x(91, 2);
  int n = 0;
  for (int a = -5; a <= 5; ++a)
    for (int b = -5; b <= 5; ++b)
      if (std::abs(a + b) <= 5) x.row(n++) << a + 0.5 * b, std::sqrt(0.75) * b;
  ASSERT_EQ(n, 91);
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Ones(n)});
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(3));
  const Cloud other(x(order, Eigen::all), {.volumes = Eigen::VectorXd::Ones(n)});
  const AssemblyOptions options{.on_degenerate = OnDegenerate::Zero};
  const Eigen::MatrixXd a =
      assemble(positive, cloud, find_neighbours(cloud, 2.2), options).matrix();
  const Eigen::MatrixXd b =
      assemble(positive, other, find_neighbours(other, 2.2), options).matrix();
  EXPECT_LT((b - a(order, order)).cwiseAbs().maxCoeff(), 1e-12);
}

// Interior rows touch each other and the boundary: no maximum inside, whatever the field.
TEST(Positive, SolutionsObeyTheMaximumPrinciple) {
  const Cloud cloud = gradpsi::cloud(2, 0.4, false, 5);
  const Operator op = assemble(positive, cloud, find_neighbours(cloud, 3 * cloud.spacing()),
                               {.on_degenerate = OnDegenerate::Zero});
  FixedValues fixed;
  for (int i = 0; i < cloud.size(); ++i)
    if (op.rows.outcome[i] == RowOutcome::Zero) {
      fixed.points.push_back(i);
      fixed.values.conservativeResize(fixed.values.size() + 1);
      fixed.values[fixed.values.size() - 1] = i % 3;
    }
  ImplicitDiffusion steady(cloud, op, {.fixed = fixed},
                           {.time_step = std::numeric_limits<double>::infinity()});
  Eigen::VectorXd u = Eigen::VectorXd::Zero(cloud.size());
  steady.step(u);
  EXPECT_GE(u.minCoeff(), -1e-12);
  EXPECT_LE(u.maxCoeff(), 2 + 1e-12);
}

/// Of the solution of lap u = f with the outermost layer held: root mean square error, entries per row.
struct Poisson {
  double error, entries;
};
Poisson poisson(const Scheme& scheme, int d, int side, double ratio) {
  const Cloud cloud =
      make_cloud(Lattice{.dimension = d, .points_per_side = side, .jitter = 0.2, .seed = 2});
  Eigen::ArrayXd u = (2.5 * cloud.positions().col(0).array()).sin();
  for (int a = 1; a < d; ++a) u *= (2.5 * cloud.positions().col(a).array()).cos();
  FixedValues fixed;
  for (int i = 0; i < cloud.size(); ++i)
    if ((cloud.positions().row(i).array() < 1.0 / side).any() ||
        (cloud.positions().row(i).array() > 1 - 1.0 / side).any())
      fixed.points.push_back(i);
  const Operator op = assemble(scheme, cloud, find_neighbours(cloud, ratio / side),
                               {.on_degenerate = OnDegenerate::Zero});
  ImplicitDiffusion steady(
      cloud, op, {.fixed = fixed},
      {.time_step = std::numeric_limits<double>::infinity(), .source = 6.25 * d * u.matrix()});
  Eigen::VectorXd found = u.matrix();
  const double inner = cloud.size() - static_cast<double>(fixed.points.size());
  steady.step(found);
  return {std::sqrt((found - u.matrix()).squaredNorm() / inner),
          static_cast<double>(op.matrix().nonZeros()) / cloud.size()};
}

// With a third (2D) to a sixth (3D) of the entries.
TEST(Positive, SolutionsAreAsAccurateAsThoseOfMixedSoc) {
  for (const int d : {2, 3}) {
    const Poisson minimal = poisson(positive, d, d == 2 ? 30 : 9, 2.5);
    const Poisson mixed = poisson("laplacian-mixed-soc", d, d == 2 ? 30 : 9, 2.5);
    EXPECT_LT(minimal.error, mixed.error);
    EXPECT_LT(minimal.entries, mixed.entries / (d == 2 ? 3 : 5));
  }
}

TEST(Positive, ARowWithoutOneFollowsThePolicy) {
  const Cloud cloud = gradpsi::cloud(2, 0.2, false);
  const Neighbours near = find_neighbours(cloud, 2.5 * cloud.spacing());
  EXPECT_THAT(message_of<StencilError>([&] { assemble(positive, cloud, near); }),
              testing::HasSubstr("at point 0: none of its stencils is positive"));
  const Operator lowered = assemble(positive, cloud, near, {.on_degenerate = OnDegenerate::Lower});
  const Operator zoc = assemble("laplacian-mixed-zoc", cloud, near);
  EXPECT_EQ(lowered.rows.outcome[0], RowOutcome::Lowered);
  const Eigen::RowVectorXd row = zoc.matrix().row(0);
  EXPECT_LT((lowered.matrix().row(0) - row).norm(), 1e-14 * row.norm());
  // Where an interior row has none, a larger support can help.
  const Neighbours few = find_neighbours(cloud, 1.3 * cloud.spacing());
  const Operator narrow = assemble(positive, cloud, few, {.on_degenerate = OnDegenerate::Zero});
  const Operator widened = assemble(positive, cloud, few, {.on_degenerate = OnDegenerate::Widen});
  EXPECT_LT(widened.rows.degenerate() - (widened.rows.degree.array() == 2).count(),
            narrow.rows.degenerate());
  EXPECT_GE((widened.rows.degree.array() == 2).count(), 14 * 14);
}

}  // namespace
}  // namespace gradpsi
