#pragma once

namespace gradpsi {

// What the vector code, too, knows of a scheme: plain numbers, without the standard library (see lanes.hpp).

/// phi(r) of a scheme times h^(d+2) / s_d (diffuse-ns: h^(d+1)) at q = r/h: a sum of the kernel's values and
/// a constant, times q^2 / (q^2 + damping).
struct Phi {
  double w = 0, w_over_q = 0, w_over_q2 = 0, dw_over_q = 0, d2w = 0, constant = 0, damping = 0;
  bool operator==(const Phi&) const = default;
};

/// What a row's weights are made of beside omega_j phi(r): combinations of trial functions of s = r_ij / h.
enum class Form {
  Constant,          ///< 1
  Monomials,         ///< s, s_a s_b for a <= b, and so on, up to the degree
  Directions,        ///< s, then e_a e_b for a <= b, e = s / |s| (Table II); the degree is 2
  KernelDerivatives  ///< with phi = 1: grad W at the point, then d^2 W / dx_a dx_b for a <= b
};

/// How a row's weights come about.
enum class How {
  Given,    ///< no conditions: the target's own combination, times a power of h
  Moments,  ///< as many trial functions as conditions, which determine their coefficients
  LeastSquares,  ///< of all weights that meet the conditions, those with the least sum a^2 / (omega |phi|)
  Programme,       ///< of all weights >= 0 that meet them, those with the least sum (r/h)^5 a
  Normalized,      ///< moments, each component by itself: of the matrix the diagonal alone
  Shepard,         ///< as given, over the sum of omega W of the neighbours
  ShapeFunctions,  ///< derivatives of shape functions, every factor differentiated
  Passes           ///< the gradient `after`, twice
};

/// What the moments are to be: the weights of `output` times monomial number `monomial` of s sum up to
/// `value` / h^order. Those that are not named are to be 0.
struct Term {
  int output, monomial;
  double value;
};

}  // namespace gradpsi
