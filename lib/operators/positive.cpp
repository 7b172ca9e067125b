#include "operators/positive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "operators/inverse.hpp"

namespace gradpsi {
namespace {

// Unknowns and equations are of the order of one.
constexpr double tolerance = 1e-12;      // of values and costs
constexpr double smallest_pivot = 1e-9;  // what is below comes from rounding
constexpr int patience = 20;             // pivots per equation before ties could mean a cycle

}  // namespace

template <int D>
void PositiveStencil<D>::start(const Columns& s, const Columns& q, const Wall<D>* wall) {
  const int neighbours = static_cast<int>(q.rows());
  n_ = neighbours + (wall ? 1 : 0);
  order_.resize(neighbours);
  std::iota(order_.begin(), order_.end(), 0);
  std::ranges::sort(order_, [&](int i, int j) {
    if (q(i) != q(j)) return q(i) < q(j);
    for (int a = 0; a < D; ++a)
      if (s(i, a) != s(j, a)) return s(i, a) < s(j, a);
    return false;
  });
  const double unit =
      q(order_[std::min(neighbours - 1, 2 * D)]);  // where the stencil's points are, about
  Columns rows = equations();
  for (int k = 0; k < neighbours; ++k) {
    const int j = order_[k];
    const double per_square = 1 / (q(j) * q(j));
    for (int a = 0; a < D; ++a) rows(k, a) = s(j, a) * unit * per_square;
    for (int a = 0, row = D; a < D; ++a)
      for (int b = a; b < D; ++b) rows(k, row++) = s(j, a) * s(j, b) * per_square;
    const double ratio = q(j) / unit;
    rows(k, m) = ratio * ratio * ratio;
  }
  value_.setZero();
  for (int a = 0; a < D; ++a) value_[diagonal_row<D>(a)] = 2;
  basis_.setConstant(-1);
  if (wall) add_slope(*wall, unit);
  tableau() = rows;
}

/// The last unknown: the slope, which costs nothing.
template <int D>
void PositiveStencil<D>::add_slope(const Wall<D>& wall, double unit) {
  Columns rows = equations();
  rows.row(n_ - 1).setZero();
  for (int a = 0; a < D; ++a) rows(n_ - 1, a) = unit * wall.normal[a];
  if (!wall.trace_only) return;
  // One equation of those for the second moments holds their trace, the others nothing.
  rows.middleCols(D, m - D).setZero();
  rows.col(D).head(n_ - 1).setOnes();  // |s|^2 / q^2
  value_.setZero();
  value_[D] = 2 * D;
}

/// The equation furthest from what it should be, or the first that is off; -1: all hold.
template <int D>
int PositiveStencil<D>::leaving(bool first) const {
  int found = -1;
  double worst = tolerance;
  for (int row = 0; row < m; ++row) {
    const double off = basis_[row] < 0 ? std::abs(value_[row]) : -value_[row];
    if (off <= worst) continue;
    found = row;
    if (first) break;
    worst = off;
  }
  return found;
}

/// The unknown that can mend the equation at the least rise of the costs; of those that can at the same,
/// the largest pivot, or the first; -1: none can, there is no solution.
template <int D>
int PositiveStencil<D>::entering(int row, bool first) {
  const Columns t = tableau();
  const double* const pivots = t.col(row).data();
  const double* const costs = t.col(m).data();
  const double sign = value_[row] > 0 ? 1 : -1;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < n_; ++k)
    if (const double a = sign * pivots[k]; a > smallest_pivot)
      least = std::min(least, (costs[k] + tolerance) / a);
  int found = -1;
  double largest = 0;
  for (int k = 0; k < n_; ++k) {
    const double a = sign * pivots[k];
    if (a <= smallest_pivot || a <= largest || costs[k] > least * a) continue;
    found = k;
    if (first) break;
    largest = a;
  }
  return found;
}

template <int D>
void PositiveStencil<D>::pivot(int row, int column) {
  Columns t = tableau();
  const double factor = 1 / t(column, row);
  t.col(row) *= factor;
  value_[row] *= factor;
  for (int other = 0; other <= m; ++other) {
    if (other == row) continue;
    const double multiple = t(column, other);
    if (multiple == 0) continue;
    t.col(other) -= multiple * t.col(row);
    t(column, other) = 0;
    if (other < m) value_[other] -= multiple * value_[row];
  }
  t(column, row) = 1;
  basis_[row] = column;
}

/// Pivots until all equations hold; false if they cannot.
template <int D>
bool PositiveStencil<D>::optimise() {
  for (int pivots = 0;; ++pivots) {
    const bool first = pivots > patience * m;  // the lowest of each: no cycle (Bland)
    const int row = leaving(first);
    if (row < 0) return true;
    const int column = entering(row, first);
    if (column < 0 || pivots > 50 * patience * m) return false;
    pivot(row, column);
  }
}

template <int D>
double PositiveStencil<D>::solve(const Columns& s, const Columns& q, Columns psi, Wall<D>* wall) {
  psi.setZero();
  if (q.rows() == 0) return 0;
  start(s, q, wall);
  const Vector rhs = value_;
  const Columns rows = equations();
  constexpr int rounds = 5;
  for (int round = 0; round < rounds; ++round) {
    // What the pivots have lost to rounding comes back from the equations themselves.
    if (!optimise()) return 0;
    Matrix basis = Matrix::Identity();
    for (int row = 0; row < m; ++row)
      if (basis_[row] >= 0) basis.col(row) = rows.row(basis_[row]).template head<m>().matrix();
    Matrix inverse = basis;
    if (!invert_general<m>(inverse)) return 0;
    const double condition = one_norm<m>(basis) * one_norm<m>(inverse);
    if (!std::isfinite(condition)) return 0;
    value_ = inverse * rhs;
    value_ += inverse * (rhs - basis * value_);
    if (leaving(true) >= 0) continue;
    for (int row = 0; row < m; ++row)
      if (basis_[row] >= 0 && value_[row] > tolerance) {
        if (basis_[row] == std::ssize(order_)) {
          wall->slope = value_[row];
          continue;
        }
        const int j = order_[basis_[row]];
        psi(j) = value_[row] / (q(j) * q(j));
      }
    return std::min(1 / condition, 1.0);
  }
  return 0;
}

template class PositiveStencil<1>;
template class PositiveStencil<2>;
template class PositiveStencil<3>;

}  // namespace gradpsi
