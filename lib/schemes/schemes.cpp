#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/names.hpp"
#include "base/text.hpp"
#include "gradpsi/scheme.hpp"
#include "schemes/monomials.hpp"
#include "schemes/recipe.hpp"
#include "schemes/targets.hpp"
#include "schemes/weights.hpp"

namespace gradpsi {
namespace {

constexpr auto Gradient = Derivative::Gradient;
constexpr auto Laplacian = Derivative::Laplacian;
constexpr auto Hessian = Derivative::Hessian;
using Weight::Diffuse, Weight::DiffuseNs, Weight::Direct, Weight::Distance, Weight::Mixed;
constexpr auto W = Weight::Kernel;
using enum Consistency;
using Symmetry::Antisymmetric, Symmetry::Symmetric;

constexpr std::string_view none, r = " r_ij", B_r = " B_i r_ij",
                                 C_r = " (C0_i r_ij + C1_i : r_ij r_ij)",
                                 C_e = " (C0_i : e_ij e_ij + C1_i . r_ij)", c_p = " c_i . p(r_ij)",
                                 psi = ">= 0, least sum (r/h)^5 psi_ij";

// Tables I and II first, then what follows them.
constexpr int classified = 17;
constexpr std::array recipes = std::to_array<Recipe>({
    // clang-format off
    {Gradient, Direct, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Antisymmetric},
    {Gradient, Direct, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-direct-zoc"},
    {Gradient, Direct, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-direct-foc"},
    {Gradient, Diffuse, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Antisymmetric},
    {Gradient, Diffuse, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-diffuse-zoc"},
    {Gradient, Diffuse, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-diffuse-foc"},
    {Gradient, DiffuseNs, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Antisymmetric},
    {Gradient, DiffuseNs, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-diffuse-ns-zoc"},
    {Gradient, DiffuseNs, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-diffuse-ns-foc"},
    {Laplacian, Direct, Zoc, 0, 0, How::Given, Form::Constant, none, none, Symmetric},
    {Laplacian, Direct, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-direct-zoc"},
    {Laplacian, Diffuse, Zoc, 0, 0, How::Given, Form::Constant, none, none, Symmetric},
    {Laplacian, Diffuse, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-diffuse-zoc"},
    {Laplacian, DiffuseNs, Zoc, 0, 0, How::Given, Form::Constant, none, none, Symmetric},
    {Laplacian, DiffuseNs, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-diffuse-ns-zoc"},
    {Laplacian, Mixed, Zoc, 0, 0, How::Given, Form::Constant, none, none, Symmetric},
    {Laplacian, Mixed, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-mixed-zoc"},
    {Laplacian, Diffuse, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-diffuse-zoc"},
    {Laplacian, DiffuseNs, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-diffuse-ns-zoc"},
    {Laplacian, Mixed, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-mixed-zoc"},
    {Laplacian, Distance, Positive, 2, 2, How::Programme, Form::Monomials, psi, "laplacian-mixed-zoc",
     Symmetry::None, true},
    {Gradient, W, LeastSquares, 1, highest_degree, How::LeastSquares, Form::Monomials, c_p,
     "gradient-direct-zoc", Symmetry::None, true},
    {Laplacian, W, LeastSquares, 2, highest_degree, How::LeastSquares, Form::Monomials, c_p,
     "laplacian-mixed-zoc", Symmetry::None, true},
    {Hessian, Mixed, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, none},
    {Hessian, W, LeastSquares, 2, highest_degree, How::LeastSquares, Form::Monomials, c_p, none,
     Symmetry::None, true},
    // clang-format on
});

Scheme scheme_of(const Recipe& row, int degree) {
  return {row.derivative, row.weight, row.consistency, row.low < row.high ? degree : 0};
}

const std::vector<Scheme>& table() {
  static const std::vector<Scheme> all = [] {
    std::vector<Scheme> result;
    for (const Recipe& row : recipes)
      for (int degree = row.low; degree <= row.high; ++degree)
        result.push_back(scheme_of(row, degree));
    return result;
  }();
  return all;
}

/// The row that holds the scheme, or could if it were of another degree; null: none.
const Recipe* find(const Scheme& scheme) {
  const auto found = std::ranges::find_if(recipes, [&](const Recipe& row) {
    return row.derivative == scheme.derivative && row.weight == scheme.weight &&
           row.consistency == scheme.consistency;
  });
  return found == recipes.end() ? nullptr : &*found;
}

}  // namespace

std::span<const Scheme> schemes() { return table(); }

std::span<const Scheme> classified_schemes() { return schemes().first(classified); }

const Recipe& recipe(const Scheme& scheme) {
  if (std::ranges::find(table(), scheme) == table().end())
    static_cast<void>(Scheme(name(scheme)));  // throws
  return *find(scheme);
}

int degree(const Scheme& scheme) {
  if (scheme.least_squares_degree > 0) return scheme.least_squares_degree;
  const Recipe* const row = find(scheme);
  return row ? row->low : 0;
}

int unknowns(const Scheme& scheme, int dimension) {
  return monomials_to(dimension, degree(scheme));
}

std::optional<double> support_ratio(const Scheme& scheme) {
  if (!recipe(scheme).brings_support) return std::nullopt;
  return std::max(2.0, degree(scheme) + 0.5);
}

std::string_view name(Consistency consistency) {
  return spelling(
      std::to_array<std::string_view>({"zoc", "foc", "soc", "soc-ls", "positive", "ls"}),
      consistency);
}

std::string_view name(Symmetry symmetry) {
  return spelling(std::to_array<std::string_view>({"none", "symmetric", "antisymmetric"}),
                  symmetry);
}

std::string consistency_name(const Scheme& scheme) {
  std::string result(name(scheme.consistency));
  if (scheme.least_squares_degree > 0) result += '-' + std::to_string(scheme.least_squares_degree);
  return result;
}

std::string name(const Scheme& scheme) {
  std::string result = std::string(name(scheme.derivative)) + '-';
  const WeightRow& weight = weight_row(scheme.weight);
  if (weight.in_names) result += std::string(weight.name) + '-';
  return result + consistency_name(scheme);
}

Scheme Scheme::from_name(std::string_view wanted) {
  std::vector<std::string> valid;
  for (const Scheme& scheme : schemes()) {
    valid.push_back(name(scheme));
    if (valid.back() == wanted) return scheme;
  }
  throw_unknown("scheme", wanted, valid);
}

std::string formula(const Scheme& scheme) {
  const Recipe& row = recipe(scheme);
  const WeightRow& weight = weight_row(row.weight);
  const std::string_view phi = order(row.derivative) == 1 ? weight.first : weight.second;
  if (phi.empty()) return std::string(row.factors);
  return "omega_j " + std::string(phi) + std::string(row.factors);
}

std::string_view conditions(const Scheme& scheme) {
  static constexpr std::array<std::string_view, highest_degree - 2> exact = {
      "exact on polynomials of degree 3", "exact on polynomials of degree 4",
      "exact on polynomials of degree 5", "exact on polynomials of degree 6"};
  const int P = degree(scheme);
  return P <= 2 ? target(scheme.derivative).conditions[P] : exact.at(P - 3);
}

Symmetry symmetry(const Scheme& scheme) { return recipe(scheme).symmetry; }

std::optional<Scheme> lowered(const Scheme& scheme) {
  const Recipe& row = recipe(scheme);
  if (degree(scheme) > row.low) return scheme_of(row, degree(scheme) - 1);
  if (row.lower.empty()) return std::nullopt;
  return Scheme(row.lower);
}

Equations equations(const Scheme& scheme, int d) {
  const Recipe& row = recipe(scheme);
  const WeightRow& weight = weight_row(row.weight);
  const Target& target = gradpsi::target(row.derivative);
  const bool constant = row.form == Form::Constant;
  const int P = constant ? 0 : row.how == How::Given ? 1 : degree(scheme);
  return {.scheme = scheme,
          .exact = degree(scheme),
          .how = row.how,
          .form = row.form,
          .degree = P,
          .unknowns = constant ? 1 : monomials_to(d, P),
          .phi = weight.phi(target.order, d),
          .given_power = P - weight.lacks,  // s = r / h gives one h back
          .order = target.order,
          .outputs = target.outputs(d),
          .terms = constant ? std::vector<Term>{{0, 0, 1}} : terms(target, d, P)};
}

}  // namespace gradpsi
