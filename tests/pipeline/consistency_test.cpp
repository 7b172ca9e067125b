// The conditions that the paper's tables promise, on irregular clouds with unequal volumes.

#include <cmath>
#include <numbers>

#include "clouds.hpp"
#include "derivatives.hpp"

namespace gradpsi {
namespace {

class Consistent : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  void SetUp() override {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const int d = std::get<1>(GetParam());
      Cloud cloud = irregular_cloud(d, d == 1 ? 50 : d == 2 ? 12 : 6, seed);
      Operator op = assemble(scheme(), cloud, find_neighbours(cloud, rich_support(cloud)));
      samples_.push_back({std::move(cloud), std::move(op)});
    }
    const Cloud cloud = periodic(samples_.back().cloud);
    samples_.push_back({cloud,
                        assemble(scheme(), cloud, find_neighbours(cloud, uneven_supports(cloud))),
                        true, scheme().consistency == Consistency::Kgf});
  }
  const Scheme& scheme() const { return std::get<0>(GetParam()); }

  struct Sample {
    Cloud cloud;
    Operator op;
    bool uneven = false;  // supports, in a periodic box
    bool wraps = false;   // neighbours of neighbours may be nearer the other way round the box

    /// Rounding of row i: its largest entry times the size of u nearby (1), times the condition.
    double tolerance(std::size_t axis, int i) const {
      return 1e-14 * Eigen::RowVectorXd(op.axes[axis].row(i)).cwiseAbs().sum() /
             op.rows.reciprocal_condition[i];
    }
    Eigen::VectorXd displacement(int i, int j) const {
      Eigen::VectorXd r = cloud.positions().row(j) - cloud.positions().row(i);
      for (int a = 0; a < cloud.dimension(); ++a)
        if (cloud.box()[a] > 0) r[a] = std::remainder(r[a], cloud.box()[a]);
      return r;
    }
    /// Expects sum_j a_ij f(x_j - x_i) = expected in every row.
    template <class F>
    void expect_moment(std::size_t axis, const F& f, double expected) const {
      if (wraps) return;
      for (int i = 0; i < cloud.size(); ++i) {
        double sum = 0;
        for (SparseMatrix::InnerIterator entry(op.axes[axis], i); entry; ++entry)
          sum += entry.value() * f(displacement(i, static_cast<int>(entry.col())));
        EXPECT_NEAR(sum, expected, tolerance(axis, i)) << "row " << i;
      }
    }
  };
  std::vector<Sample> samples_;
};

// To zero, those of values to one.
TEST_P(Consistent, RowsSumToTheDerivativeOfOne) {
  const double expected = scheme().derivative == Derivative::Value;
  for (const auto& sample : samples_)
    for (const SparseMatrix& matrix : sample.op.axes)
      for (int i = 0; i < matrix.rows(); ++i) {
        const Eigen::RowVectorXd row = matrix.row(i);
        EXPECT_NEAR(row.sum(), expected, 1e-14 * row.cwiseAbs().sum());
      }
}

class FirstOrder : public Consistent {};
TEST_P(FirstOrder, MeetsItsLinearConditions) {
  for (const auto& sample : samples_) {
    const int d = sample.cloud.dimension();
    const auto outputs = partials(scheme().derivative, d);
    for (std::size_t axis = 0; axis < sample.op.axes.size(); ++axis)
      for (int a = 0; a < d; ++a)
        sample.expect_moment(
            axis, [a](const auto& r) { return r[a]; },
            of_monomial(outputs[axis], Eigen::VectorXi::Unit(d, a)));  // [4]; [9]
  }
}

class SecondOrder : public Consistent {};
TEST_P(SecondOrder, MeetsItsQuadraticConditions) {
  for (const auto& sample : samples_) {
    const int d = sample.cloud.dimension();
    const auto outputs = partials(scheme().derivative, d);
    for (std::size_t axis = 0; axis < sample.op.axes.size(); ++axis)
      for (int a = 0; a < d; ++a)
        for (int b = a; b < d; ++b)
          sample.expect_moment(
              axis, [=](const auto& r) { return r[a] * r[b]; },
              of_monomial(outputs[axis],
                          Eigen::VectorXi::Unit(d, a) + Eigen::VectorXi::Unit(d, b)));  // [5]; [10]
  }
}

TEST_P(Consistent, IsSymmetricAfterScalingByVolumeIfItsTableSaysSo) {
  for (const auto& sample : samples_)
    for (const SparseMatrix& matrix : sample.op.axes) {
      if (sample.uneven) continue;  // symmetry needs one support
      Eigen::MatrixXd scaled = sample.cloud.volumes().asDiagonal() * Eigen::MatrixXd(matrix);
      scaled.diagonal().setZero();
      const double symmetric = (scaled - scaled.transpose()).norm() / scaled.norm();
      const double antisymmetric = (scaled + scaled.transpose()).norm() / scaled.norm();
      EXPECT_EQ(symmetric < 1e-14, symmetry(scheme()) == Symmetry::Symmetric);
      EXPECT_EQ(antisymmetric < 1e-14, symmetry(scheme()) == Symmetry::Antisymmetric);
    }
}

INSTANTIATE_TEST_SUITE_P(Consistency, Consistent, compact_schemes_and_dimensions(), case_name);
INSTANTIATE_TEST_SUITE_P(Consistency, FirstOrder,
                         testing::Combine(testing::ValuesIn(compact_schemes(1)),
                                          testing::Values(1, 2, 3)),
                         case_name);
INSTANTIATE_TEST_SUITE_P(Consistency, SecondOrder,
                         testing::Combine(testing::ValuesIn(compact_schemes(2)),
                                          testing::Values(1, 2, 3)),
                         case_name);

/// L2 error of the Laplacian of the product of cos(2 pi x_a) on a periodic lattice.
double periodic_error(const Scheme& scheme, int dimension, int points_per_side, double ratio) {
  const double two_pi = 2 * std::numbers::pi;
  const Cloud cloud = make_cloud(
      Lattice{.dimension = dimension, .points_per_side = points_per_side, .periodic = true});
  const Operator op = assemble(scheme, cloud, find_neighbours(cloud, ratio * cloud.spacing()));
  const Eigen::VectorXd u = (two_pi * cloud.positions().array()).cos().rowwise().prod();
  const Eigen::VectorXd error = op.matrix() * u + dimension * two_pi * two_pi * u;
  return std::sqrt(error.squaredNorm() / cloud.size());
}

// Shifting by a lattice step maps every row onto another: no boundary rows are special.
TEST(PeriodicLattice, EveryRowHasTheSameEntries) {
  for (const int d : {1, 2, 3}) {
    constexpr int m = 7;
    const Cloud cloud = make_cloud(Lattice{.dimension = d, .points_per_side = m, .periodic = true});
    const Neighbours near = find_neighbours(cloud, 2.6 / m);
    // The point that lies `step` beyond point i in every direction.
    const auto shifted = [&](int i, int step) {
      int j = 0;
      for (int a = 0, unit = 1; a < d; ++a, unit *= m) j += (i / unit + step) % m * unit;
      return j;
    };
    for (const Scheme& scheme : schemes()) {
      if (degree(scheme) > 2) continue;
      for (const SparseMatrix& matrix : assemble(scheme, cloud, near).axes) {
        const double tolerance = 1e-11 * matrix.coeffs().abs().maxCoeff();
        for (int i = 0; i < cloud.size(); i += 5)
          for (int j = 0; j < cloud.size(); ++j)
            ASSERT_NEAR(matrix.coeff(shifted(i, 3), shifted(j, 3)), matrix.coeff(i, j), tolerance)
                << name(scheme) << " " << d << "D";
      }
    }
  }
}

// On a lattice the uncorrected mixed Laplacian approximates a multiple of the Laplacian, with a
// factor that nears 1 as the support holds more points; at a fixed ratio its error levels off
// there.
TEST(PeriodicLattice, UncorrectedMixedLaplacianConvergesInTheLatticesLimit) {
  for (const int d : {1, 2}) {
    const Scheme mixed("laplacian-mixed-zoc");
    const double scale = d * 4 * std::numbers::pi * std::numbers::pi;
    // Fixed ratio: two refinements leave the relative error at the lattice's own.
    EXPECT_NEAR(periodic_error(mixed, d, 64, 2.5) / periodic_error(mixed, d, 128, 2.5), 1, 0.1);
    // Support shrinking more slowly than the spacing: it goes on falling.
    const double coarse = periodic_error(mixed, d, 32, 3.3) / scale;
    const double middle = periodic_error(mixed, d, 64, 4.4) / scale;
    const double fine = periodic_error(mixed, d, 128, 5.7) / scale;
    EXPECT_LT(middle, 0.6 * coarse);
    EXPECT_LT(fine, 0.6 * middle);
  }
}

TEST(PeriodicLattice, SecondOrderLaplaciansConvergeWithOrderTwo) {
  for (const Scheme& scheme : schemes()) {
    if (scheme.derivative != Derivative::Laplacian || degree(scheme) != 2) continue;
    for (const int d : {1, 2}) {
      const double ratio = periodic_error(scheme, d, 24, 2.5) / periodic_error(scheme, d, 48, 2.5);
      EXPECT_NEAR(std::log2(ratio), 2, 0.05) << name(scheme);
    }
  }
}

}  // namespace
}  // namespace gradpsi
