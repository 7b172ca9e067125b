#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gradpsi/scheme.hpp"
#include "schemes/forms.hpp"

namespace gradpsi {

/// A row of the table of targets: a derivative as what it makes of monomials at 0.
struct Target {
  std::string_view name;
  int order;  // of the derivative
  std::string_view
      conditions[3];  // met by schemes of degree 0, 1, 2, with the paper's equation numbers
  int (*outputs)(int dimension);                        // matrices
  std::string (*component)(int dimension, int output);  // the output's axes, "x", "xy", or nothing
  /// What output o makes of the monomial s_0^powers[0] s_1^powers[1] ..
  double (*of)(int output, std::span<const int> powers);
};

/// The derivative's row.
const Target& target(Derivative derivative);

/// Of the monomials of degree 1 to `degree`, in the order of MonomialTable, those that the target does not
/// make 0.
std::vector<Term> terms(const Target& target, int dimension, int degree);

/// What weights without conditions are of the form's functions.
std::vector<Term> given_terms(const Target& target, Form form, int dimension);

}  // namespace gradpsi
