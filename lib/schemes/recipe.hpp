#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "gradpsi/scheme.hpp"
#include "schemes/forms.hpp"

namespace gradpsi {

/// A row of the table of schemes: all that is known of a scheme, or of a family of several degrees.
struct Recipe {
  Derivative derivative;
  Weight weight;
  Consistency consistency;
  int low, high;  // degrees
  How how;
  Form form;
  std::string_view factors;  // of the weights, behind omega_j phi(r), in plain text
  std::string_view
      lower;  // the scheme that degenerate rows of the lowest degree fall to, or nothing
  Symmetry symmetry = Symmetry::None;
  bool brings_support = false;  // degree + 1/2 spacings, at least 2
};

/// The scheme's row.
/// @throws InvalidInput  if it is not one of schemes()
const Recipe& recipe(const Scheme& scheme);

/// The scheme of the next lower consistency, for rows that cannot be solved.
std::optional<Scheme> lowered(const Scheme& scheme);

/// A scheme in some dimension as the equations of its rows: what weights are made of, and which moments
/// they are to have.
struct Equations {
  Scheme scheme;
  int exact;  // degree of the polynomials that are differentiated exactly
  How how;
  Form form;
  int degree;               // of the form's functions
  int unknowns;             // their number
  Phi phi;                  // what weighs them
  int given_power;          // of h, that uncorrected weights want as a factor
  int order;                // of the derivative
  int outputs;              // matrices
  std::vector<Term> terms;  // for the form's functions, if How::Given, else for monomials
};
Equations equations(const Scheme& scheme, int dimension);

}  // namespace gradpsi
