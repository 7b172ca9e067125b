#pragma once

#include <Eigen/Core>

#include "base/resize.hpp"
#include "schemes/forms.hpp"
#include "schemes/monomials.hpp"

namespace gradpsi {

/// Numbers about a row's n neighbours: n x c, each column contiguous.
using Columns = Eigen::Map<Eigen::ArrayXXd>;

/// Memory for Columns that grows as needed and is used again for the next row.
class Buffer {
 public:
  Columns columns(int n, int c) {
    if (memory_.size() < Eigen::Index{n} * c) resize(memory_, Eigen::Index{n} * c);
    return {memory_.data(), n, c};
  }

 private:
  Eigen::ArrayXd memory_;  // aligned: the order of vectorised sums depends on it
};

/// The number of monomials of degree 1 and 2: d + d(d+1)/2.
template <int D>
inline constexpr int quadratic_size = monomial_count<D, 2>;

/// Where a quadratic basis holds s_a^2; the upper triangle of s s^T is stored row by row.
template <int D>
constexpr int diagonal_row(int a) {
  return D + a * D - a * (a - 1) / 2;
}

/// Whether a quadratic basis holds s_a^2 there.
template <int D>
constexpr bool is_square(int monomial) {
  for (int a = 0; a < D; ++a)
    if (monomial == diagonal_row<D>(a)) return true;
  return false;
}

/// Puts the monomials of the scaled displacements s (n x D), as many as t has columns, into these.
template <int D>
void fill_monomials(const Columns& s, Columns t) {
  constexpr const auto& table = monomial_table<D, highest_degree>;
  t.template leftCols<D>() = s;
  for (int k = D; k < t.cols(); ++k) t.col(k) = s.col(table.factor[k]) * t.col(table.rest[k]);
}

/// The same without the linear ones.
template <int D>
void fill_quadratic_monomials(const Columns& s, Columns t) {
  constexpr const auto& table = monomial_table<D, 2>;
  for (int k = 0; k < t.cols(); ++k)
    t.col(k) = s.col(table.factor[D + k]) * s.col(table.rest[D + k]);
}

/// The form's trial functions of s (n x D) and q = |s| (n x 1), as many as t has columns.
template <int D>
void fill_trial(Form form, const Columns& s, const Columns& q, Columns t) {
  if (form == Form::Constant) {
    t.setOnes();
    return;
  }
  fill_monomials<D>(s, t);
  if (form != Form::Directions) return;
  // The first column holds 1 / q^2 until the others have been divided.
  t.col(0) = 1 / q.col(0).square();
  for (Eigen::Index column = D; column < t.cols(); ++column) t.col(column) *= t.col(0);
  t.col(0) = s.col(0);
}

/// The first derivatives of W at the point and, if t has more columns than these, the second ones; of s (n x D),
/// q = |s| (n x 1) and the kernel's profile (n x 3). Without the first ones, if so asked.
template <int D>
void fill_kernel_derivatives(const Columns& s, const Columns& q, const Columns& profile,
                             bool second_only, Columns t) {
  const auto dw_over_q = profile.col(1), d2w = profile.col(2);
  if (!second_only)
    for (int a = 0; a < D; ++a) t.col(a) = -dw_over_q * s.col(a);
  constexpr const auto& table = monomial_table<D, 2>;
  for (int k = D, c = second_only ? 0 : D; c < t.cols(); ++k, ++c) {
    t.col(c) =
        (d2w - dw_over_q) / q.col(0).square() * s.col(table.factor[k]) * s.col(table.rest[k]);
    if (is_square<D>(k)) t.col(c) += dw_over_q;
  }
}

}  // namespace gradpsi
