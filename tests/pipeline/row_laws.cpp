#include <array>
#include <cmath>

#include "derivatives.hpp"
#include "oracle.hpp"
#include "pipeline/laws.hpp"

namespace gradpsi {
namespace {

void rows_are_finite_and_sum_to_the_derivative_of_one(const RandomCase& c, const Operator& op) {
  const bool value = c.scheme.derivative == Derivative::Value;
  Worst worst;
  for (const SparseMatrix& matrix : op.axes) {
    EXPECT_TRUE(matrix.coeffs().isFinite().all());
    for (int i = 0; i < matrix.rows(); ++i) {
      const Eigen::RowVectorXd row = matrix.row(i);
      if (op.rows.degree[i] < 0) continue;
      worst.add(std::abs(row.sum() - value), eps * row.size() * row.cwiseAbs().sum(), i);
    }
  }
  EXPECT_WITHIN(worst);
}

void degrees_are_those_asked_for(const RandomCase& c, const Operator& op) {
  for (int i = 0; i < c.size(); ++i) {
    const RowOutcome outcome = op.rows.outcome[i];
    const bool whole = outcome == RowOutcome::AsAsked || outcome == RowOutcome::Widened;
    const double h = c.supports[c.supports.size() > 1 ? i : 0];
    if (outcome == RowOutcome::Widened) {
      EXPECT_GT(op.rows.supports[i], h);
      EXPECT_LE(op.rows.supports[i], widest * h);
    } else {
      EXPECT_EQ(op.rows.supports[i], h);
    }
    if (whole) {
      EXPECT_EQ(op.rows.degree[i], degree(c.scheme));
    } else if (outcome == RowOutcome::Lowered) {
      EXPECT_LT(op.rows.degree[i], degree(c.scheme));
      EXPECT_GE(op.rows.degree[i], 0);
    } else {
      EXPECT_EQ(op.rows.degree[i], -1);
      for (const SparseMatrix& matrix : op.axes) EXPECT_EQ(matrix.row(i).norm(), 0);
    }
  }
}

std::vector<std::array<int, 3>> exponents(int d, int most) {
  std::vector<std::array<int, 3>> all;
  for (int k = 0; k <= most; ++k)
    for (int l = 0; l <= (d > 1 ? most - k : 0); ++l)
      for (int m = 0; m <= (d > 2 ? most - k - l : 0); ++m)
        if (k + l + m > 0) all.push_back({k, l, m});
  return all;
}

/// In units of the support, where |s| < 1.
void conditions_are_met(const RandomCase& c, const Operator& op) {
  // Neighbours of neighbours may be nearer the other way round the box.
  if (c.scheme.consistency == Consistency::Kgf &&
      Eigen::Map<const Eigen::Array3d>(c.cloud.box().data()).any())
    return;
  Worst worst;
  const int d = c.dimension();
  for (int i = 0; i < c.size(); ++i) {
    const auto monomials = exponents(d, std::max(op.rows.degree[i], 0));
    const double h = op.rows.supports[i], rcond = reciprocal_condition(op, i);
    if (rcond == 0) continue;
    const auto outputs = partials(c.scheme.derivative, d);
    for (std::size_t axis = 0; axis < op.axes.size() && !monomials.empty(); ++axis) {
      std::vector<double> moments(monomials.size());
      double size = 0;
      for (SparseMatrix::InnerIterator entry(op.axes[axis], i); entry; ++entry) {
        const Eigen::VectorXd s = c.displacement(i, static_cast<int>(entry.col()), h);
        const double a = entry.value() * std::pow(h, order(c.scheme.derivative));
        size += std::abs(a);
        std::array<std::array<double, 7>, 3> powers;
        for (int b = 0; b < d; ++b) {
          powers[b][0] = 1;
          for (int k = 1; k < 7; ++k) powers[b][k] = powers[b][k - 1] * s[b];
        }
        for (std::size_t m = 0; m < monomials.size(); ++m) {
          double product = a;
          for (int b = 0; b < d; ++b) product *= powers[b][monomials[m][b]];
          moments[m] += product;
        }
      }
      for (std::size_t m = 0; m < monomials.size(); ++m) {
        const double target =
            of_monomial(outputs[axis], Eigen::Map<const Eigen::VectorXi>(monomials[m].data(), d));
        worst.add(std::abs(moments[m] - target), 30 * eps / rcond * size, i);
      }
    }
  }
  EXPECT_WITHIN(worst);
}

void a_few_rows_agree_with_the_literal_formula(const RandomCase& c, const Operator& op,
                                               Random& random) {
  if (!has_oracle(c.scheme) || !c.ordinary_unit) return;
  const Cloud cloud(c.cloud.positions(), {.volumes = op.volumes, .box = c.cloud.box()});
  for (int k = 0; k < 3; ++k) {
    const int i = random.below(c.size());
    if (op.rows.outcome[i] != RowOutcome::AsAsked) continue;
    const OracleRow row = oracle_row(c.scheme, cloud, op.rows.supports[i], i, c.options.kernel);
    Worst worst;
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
      const Eigen::RowVectorXd expected = row.weights.row(static_cast<Eigen::Index>(axis));
      worst.add((expected - Eigen::RowVectorXd(op.axes[axis].row(i))).cwiseAbs().maxCoeff(),
                30 * eps / row.reciprocal_condition * expected.cwiseAbs().sum(), i);
    }
    EXPECT_WITHIN(worst);
  }
}

void weights_have_the_symmetry_promised(const RandomCase& c, const Operator& op) {
  const Symmetry promised = symmetry(c.scheme);
  if (promised == Symmetry::None || c.supports.size() > 1 || op.rows.degenerate() > 0) return;
  const double sign = promised == Symmetry::Symmetric ? 1 : -1;
  Worst worst;
  const auto matrices = dense(op);
  Eigen::MatrixXd size = Eigen::MatrixXd::Zero(c.size(), c.size());  // of what components cancel in
  for (const Eigen::MatrixXd& matrix : matrices) size += matrix.cwiseAbs();
  for (const Eigen::MatrixXd& matrix : matrices)
    for (int i = 0; i < c.size(); ++i)
      for (int j = 0; j < i; ++j) {
        const double of_i = op.volumes[i] / c.unit, of_j = op.volumes[j] / c.unit;
        worst.add(std::abs(of_i * matrix(i, j) - sign * of_j * matrix(j, i)),
                  30 * eps * (of_i * size(i, j) + of_j * size(j, i)), i);
      }
  EXPECT_WITHIN(worst);
}

void positive_stencils_are(const RandomCase& c, const Operator& op) {
  if (!c.positive()) return;
  for (int i = 0; i < c.size(); ++i) {
    if (op.rows.degree[i] < 2) continue;
    EXPECT_LE(op.matrix().row(i).nonZeros(), unknowns(c.scheme, c.dimension()) + 1);
    for (SparseMatrix::InnerIterator a(op.matrix(), i); a; ++a)
      EXPECT_EQ(a.value() > 0, a.col() != i) << i;
  }
}

}  // namespace

void rows_obey_their_laws(const RandomCase& c, const Operator& op, Random& random) {
  rows_are_finite_and_sum_to_the_derivative_of_one(c, op);
  degrees_are_those_asked_for(c, op);
  conditions_are_met(c, op);
  a_few_rows_agree_with_the_literal_formula(c, op, random);
  weights_have_the_symmetry_promised(c, op);
  positive_stencils_are(c, op);
}

}  // namespace gradpsi
