#pragma once

#include <limits>
#include <vector>

#include "pipeline/random_case.hpp"

namespace gradpsi {

constexpr double eps = std::numeric_limits<double>::epsilon();

/// The largest of many ratios of error to tolerance, and where it is.
struct Worst {
  double ratio = 0;
  int row = -1;
  void add(double error, double tolerance, int i) {
    const double r = error <= tolerance * 1e300 ? error / tolerance : 1e300;  // NaN, too
    if (error > 0 || std::isnan(error))
      if (!(r <= ratio)) ratio = r, row = i;
  }
};
#define EXPECT_WITHIN(worst) EXPECT_LE((worst).ratio, 1) << "in row " << (worst).row

using Dense = std::vector<Eigen::MatrixXd>;
inline Dense dense(const Operator& op) { return {op.axes.begin(), op.axes.end()}; }

/// The reciprocal condition number that the rounding of row i goes with; 0: nothing can be expected.
inline double reciprocal_condition(const Operator& op, int i) {
  if (op.rows.degree[i] <= 0) return 1;  // zoc or zero
  if (op.rows.outcome[i] == RowOutcome::Lowered)
    return 0;  // that of the lower system is not reported
  return op.rows.reciprocal_condition[i];
}

/// That the operators, on the same points seen in another way, agree up to rounding. So near to singular
/// that it matters for a row's outcome, anything may happen.
/// @param lost  how much larger the rounding of the points is than that of a product
void expect_same(const RandomCase& c, const Operator& a, const Dense& expected, const Operator& b,
                 const Dense& found, double lost);

/// .. to the last bit, rows of `b` being times `factor`.
void expect_identical(const Operator& a, const Operator& b, double factor = 1);

/// What holds of an operator by itself: finite, conditions, degrees, symmetry, the literal formula.
void rows_obey_their_laws(const RandomCase& c, const Operator& op, Random& random);

/// What holds between it and the same points moved, in another unit, renumbered, turned.
void other_views_agree(const RandomCase& c, const Operator& op, Random& random);

}  // namespace gradpsi
