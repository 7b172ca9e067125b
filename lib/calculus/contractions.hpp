#pragma once

namespace gradpsi {

// The operators on vectors as data: sums over products of a matrix and a component. Vector code is made of
// these tables and so are block matrices.

/// One of them: result += factor * (matrix times component).
struct Product {
  int matrix, component, result;
  double factor;
};

/// What an operator sums up in some dimension. Without results there is no such operator there.
struct Contraction {
  int matrices = 0, components = 0, results = 0;  ///< how many
  int count = 0;
  Product terms[9] = {};  ///< the first `count`; those of a result in the order of the components

  constexpr void add(int matrix, int component, int result, double factor = 1) {
    terms[count++] = {matrix, component, result, factor};
  }
};

/// The place of (a, b) = (b, a) among xx, xy, yy or xx, xy, xz, yy, yz, zz.
constexpr int symmetric_pair(int a, int b, int d) {
  return a > b ? symmetric_pair(b, a, d) : a * d - a * (a - 1) / 2 + b - a;
}

namespace contractions {

constexpr Contraction gradient(int d) {
  Contraction c{d, 1, d};
  for (int a = 0; a < d; ++a) c.add(a, 0, a);
  return c;
}

constexpr Contraction divergence(int d) {
  Contraction c{d, d, 1};
  for (int a = 0; a < d; ++a) c.add(a, a, 0);
  return c;
}

constexpr Contraction curl(int d) {
  if (d == 1) return {1, 1, 0};
  if (d == 2) {
    Contraction c{2, 2, 1};
    c.add(1, 0, 0, -1);
    c.add(0, 1, 0);
    return c;
  }
  Contraction c{3, 3, 3};
  for (int b = 0; b < 3; ++b)  // component b of v turns about the two other axes
    for (int a = 0; a < 3; ++a)
      if (a != b) c.add(a, b, 3 - a - b, b == (a + 1) % 3 ? 1 : -1);
  return c;
}

constexpr Contraction velocity_gradient(int d) {
  Contraction c{d, d, d * d};
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < d; ++b) c.add(b, a, a * d + b);
  return c;
}

constexpr Contraction strain(int d) {
  Contraction c{d, d, d * (d + 1) / 2};
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < d; ++b) c.add(b, a, symmetric_pair(a, b, d), a == b ? 1 : 0.5);
  return c;
}

constexpr Contraction grad_div(int d) {
  Contraction c{d * (d + 1) / 2, d, d};
  for (int b = 0; b < d; ++b)
    for (int a = 0; a < d; ++a) c.add(symmetric_pair(a, b, d), b, a);
  return c;
}

}  // namespace contractions

struct VectorOperatorRow {
  const char* name;
  int directions;               ///< that a number of the result has: 0 a scalar's, 1 a vector's, 2
  Contraction by_dimension[3];  ///< in 1, 2 and 3 dimensions
};

constexpr VectorOperatorRow row(const char* name, int directions, Contraction (*in)(int)) {
  return {name, directions, {in(1), in(2), in(3)}};
}

/// In the order of VectorOperator. The curl has no direction in 2D.
inline constexpr VectorOperatorRow vector_operator_rows[] = {
    row("gradient", 1, contractions::gradient),
    row("divergence", 0, contractions::divergence),
    row("curl", 1, contractions::curl),
    row("velocity-gradient", 2, contractions::velocity_gradient),
    row("strain", 2, contractions::strain),
    row("grad-div", 1, contractions::grad_div),
};
inline constexpr int vector_operator_count =
    sizeof vector_operator_rows / sizeof *vector_operator_rows;

}  // namespace gradpsi
