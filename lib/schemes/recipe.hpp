#pragma once

#include <optional>
#include <span>
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
  // Of the weights, in plain text; with a space in front, behind omega_j phi(r).
  std::string_view factors;
  // The scheme that degenerate rows of the lowest degree fall to, or nothing.
  std::string_view lower;
  Symmetry symmetry = Symmetry::None;
  bool brings_support = false;  // degree + 1/2 spacings, at least 2
  bool fitted = false;          // whether u_i is an unknown of the fit, rather than taken as it is
  // The gradient that takes the weights' first moments away, or makes the passes.
  std::string_view after = {};
  double damping = 0;           // of phi
  double diagonal = -1;         // times the sum of the others
  std::string_view meets = {};  // what it has not in common with others of its degree
};

/// The table, those of Tables I and II first.
std::span<const Recipe> recipes();
inline constexpr int classified = 17;

/// Whether schemes of this consistency are called by their weight, or by their degree.
bool named_by_weight(Consistency consistency);
bool named_by_degree(Consistency consistency);

/// The scheme's row.
/// @throws InvalidInput  if it is not one of schemes()
const Recipe& recipe(const Scheme& scheme);

/// The scheme of the next lower consistency, for rows that cannot be solved.
std::optional<Scheme> lowered(const Scheme& scheme);

/// A scheme in some dimension as the equations of its rows: what weights are made of, and which moments
/// they are to have.
struct Equations {
  Scheme scheme;
  int exact;  // degree of the polynomials that are differentiated exactly; -1: none
  How how;
  Form form;
  int degree;    // of the form's functions
  int skipped;   // those of lower degree that are none of them, at the beginning of the monomials
  int unknowns;  // their number
  Phi phi;       // what weighs them
  bool fitted;   // less their mean times W, the point's own among it
  int given_power;          // of h, that uncorrected weights want as a factor
  int order;                // of the derivative
  int outputs;              // matrices
  double diagonal;          // what it is times the sum of the others
  double constant;          // what is added to it: the derivative of 1
  std::vector<Term> terms;  // for the form's functions, if without conditions, else for monomials
  std::vector<Equations> after;  // of the gradient that takes first moments away, or none
};
Equations equations(const Scheme& scheme, int dimension);

}  // namespace gradpsi
