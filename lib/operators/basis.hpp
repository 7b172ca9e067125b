#pragma once

#include <Eigen/Core>

#include "base/resize.hpp"
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

// Functions of the scaled displacement s = r_ij / h, q = |s|, that a scheme's weights are made of
// and tested with. fill() puts their `size` components for all neighbours into the columns of t;
// s is n x D, q n x 1.

/// The number of monomials of degree 1 and 2: d + d(d+1)/2.
template <int D>
inline constexpr int quadratic_size = monomial_count<D, 2>;

/// Where a quadratic basis holds s_a^2; the upper triangle of s s^T is stored row by row.
template <int D>
constexpr int diagonal_row(int a) {
  return D + a * D - a * (a - 1) / 2;
}

/// 1
template <int D>
struct Constant {
  static constexpr int size = 1;
  static void fill(const Columns&, const Columns&, Columns t) { t.setOnes(); }
};

/// All monomials of degree 1 to P, in the order of MonomialTable.
template <int D, int P>
struct Monomials {
  static constexpr int size = monomial_count<D, P>;
  static void fill(const Columns& s, const Columns&, Columns t) {
    t.template leftCols<D>() = s;
    constexpr const auto& table = monomial_table<D, P>;
    for (int k = D; k < size; ++k) t.col(k) = s.col(table.factor[k]) * t.col(table.rest[k]);
  }
};

/// s
template <int D>
using Linear = Monomials<D, 1>;

/// p(r) of the schemes: s, then s_a s_b for a <= b.
template <int D>
using Quadratic = Monomials<D, 2>;

/// t of Table II: s, then e_a e_b for a <= b, e = s / q.
template <int D>
struct Directions {
  static constexpr int size = quadratic_size<D>;
  static void fill(const Columns& s, const Columns& q, Columns t) {
    Quadratic<D>::fill(s, q, t);
    // The first column holds 1 / q^2 until the others have been divided.
    t.col(0) = 1 / q.col(0).square();
    for (int column = D; column < size; ++column) t.col(column) *= t.col(0);
    t.col(0) = s.col(0);
  }
};

}  // namespace gradpsi
