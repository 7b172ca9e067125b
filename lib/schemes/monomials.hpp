#pragma once

namespace gradpsi {

/// The number of monomials of degree 1 to P in D dimensions.
template <int D, int P>
inline constexpr int monomial_count = (monomial_count<D - 1, P> + 1) * (D + P) / D - 1;
template <int P>
inline constexpr int monomial_count<1, P> = P;

/// The same for numbers that are known at run time.
constexpr int monomials_to(int dimension, int degree) {
  int count = 1;  // the constant one among them
  for (int a = 1; a <= dimension; ++a) count = count * (degree + a) / a;
  return count - 1;
}

/// The highest degree of a scheme.
inline constexpr int highest_degree = 6;

/// The monomials of degree 1 to P of s, degree by degree: s, then s_a s_b for a <= b, and so on.
/// Number k >= D is s_factor[k] times number rest[k]. A lower P has the first of them.
template <int D, int P>
struct MonomialTable {
  static constexpr int size = monomial_count<D, P>;
  int factor[size] = {}, rest[size] = {}, powers[size][D] = {};

  constexpr MonomialTable() {
    int first[D] = {};  // those of the last degree whose factors are s_a or later ones begin here
    for (int a = 0; a < D; ++a) first[a] = a, powers[a][a] = 1;
    for (int column = D; column < size;) {
      const int end = column;
      for (int a = 0; a < D; ++a) {
        const int begin = first[a];
        first[a] = column;
        for (int k = begin; k < end; ++k, ++column) {
          factor[column] = a;
          rest[column] = k;
          for (int b = 0; b < D; ++b) powers[column][b] = powers[k][b] + (a == b);
        }
      }
    }
  }

  /// The number of the product of two, whose degrees must add up to at most P.
  constexpr int product(int k, int l) const {
    for (int m = 0; m < size; ++m) {
      bool same = true;
      for (int b = 0; b < D; ++b) same = same && powers[m][b] == powers[k][b] + powers[l][b];
      if (same) return m;
    }
    return -1;
  }
};

template <int D, int P>
inline constexpr MonomialTable<D, P> monomial_table{};

}  // namespace gradpsi
