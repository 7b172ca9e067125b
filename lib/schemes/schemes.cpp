#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/names.hpp"
#include "base/text.hpp"
#include "gradpsi/cited.hpp"
#include "gradpsi/scheme.hpp"
#include "schemes/monomials.hpp"
#include "schemes/recipe.hpp"
#include "schemes/targets.hpp"
#include "schemes/weights.hpp"

namespace gradpsi {
namespace {

Scheme scheme_of(const Recipe& row, int degree) {
  return {row.derivative, row.weight, row.consistency,
          named_by_degree(row.consistency) ? degree : 0};
}

const std::vector<Scheme>& table() {
  static const std::vector<Scheme> all = [] {
    std::vector<Scheme> result;
    for (const Recipe& row : recipes())
      for (int degree = row.low; degree <= row.high; ++degree)
        result.push_back(scheme_of(row, degree));
    return result;
  }();
  return all;
}

/// The row that holds the scheme, or could if it were of another degree; null: none.
const Recipe* find(const Scheme& scheme) {
  const auto found = std::ranges::find_if(recipes(), [&](const Recipe& row) {
    return row.derivative == scheme.derivative && row.weight == scheme.weight &&
           row.consistency == scheme.consistency;
  });
  return found == recipes().end() ? nullptr : &*found;
}

/// The number of monomials of degree 2.
int quadratic(int dimension) { return dimension * (dimension + 1) / 2; }

/// Whether conditions of degree 2 alone are met, and then those of degree 1 by way of a gradient.
bool first_moments_taken_away(const Recipe& row) {
  return row.how == How::Moments && !row.after.empty();
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
  const Recipe* const row = find(scheme);
  return row && first_moments_taken_away(*row)
             ? quadratic(dimension)
             : monomials_to(dimension, std::max(0, degree(scheme)));
}

std::optional<double> support_ratio(const Scheme& scheme) {
  if (!recipe(scheme).brings_support) return std::nullopt;
  return std::max(2.0, degree(scheme) + 0.5);
}

int reach(const Scheme& scheme) { return recipe(scheme).how == How::Passes ? 2 : 1; }

std::string_view name(Symmetry symmetry) {
  return spelling(std::to_array<std::string_view>({"none", "symmetric", "antisymmetric"}),
                  symmetry);
}

std::string consistency_name(const Scheme& scheme) {
  std::string result(name(scheme.consistency));
  if (named_by_degree(scheme.consistency)) result += '-' + std::to_string(degree(scheme));
  return result;
}

std::string name(const Scheme& scheme) {
  std::string result = std::string(name(scheme.derivative)) + '-';
  if (named_by_weight(scheme.consistency)) result += std::string(name(scheme.weight)) + '-';
  return result + consistency_name(scheme);
}

Scheme Scheme::from_name(std::string_view wanted) {
  std::vector<std::string> valid;
  for (const Scheme& scheme : schemes()) {
    valid.push_back(name(scheme));
    if (valid.back() == wanted) return scheme;
  }
  for (const CitedSystem& cited : cited_systems()) {
    if (cited.equal_to.empty()) continue;
    valid.emplace_back(cited.name);
    if (valid.back() == wanted) return cited.equal_to;
  }
  throw_unknown("scheme", wanted, valid);
}

std::string formula(const Scheme& scheme) {
  const Recipe& row = recipe(scheme);
  const WeightRow& weight = weight_row(row.weight);
  const std::string_view phi = order(row.derivative) == 1 ? weight.first : weight.second;
  if (phi.empty() || (!row.factors.empty() && row.factors.front() != ' '))
    return std::string(row.factors);
  return "omega_j " + std::string(phi) + std::string(row.factors);
}

std::string_view conditions(const Scheme& scheme) {
  static constexpr std::array<std::string_view, highest_degree - 2> exact = {
      "exact on polynomials of degree 3", "exact on polynomials of degree 4",
      "exact on polynomials of degree 5", "exact on polynomials of degree 6"};
  if (const Recipe* const row = find(scheme); row && !row->meets.empty()) return row->meets;
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
  const bool without_conditions = row.how == How::Given || row.how == How::Shepard;
  const bool quadratics_only = first_moments_taken_away(row);
  const int P = row.form == Form::Constant     ? 0
                : row.form == Form::Directions ? 2
                : without_conditions           ? 1
                : quadratics_only              ? 2
                                  : std::max(row.how == How::LeastSquares ? 0 : 1, degree(scheme));
  const int skipped = quadratics_only ? d : 0;
  Equations result{
      .scheme = scheme,
      .exact = degree(scheme),
      .how = row.how,
      .form = row.form,
      .degree = P,
      .skipped = skipped,
      .unknowns = row.form == Form::Constant ? 1 : monomials_to(d, P) - skipped,
      .phi = weight.phi(target.order, d),
      .fitted = row.fitted,
      .given_power = (row.form == Form::Monomials) - weight.lacks,  // s = r / h gives one h back
      .order = target.order,
      .outputs = target.outputs(d),
      .diagonal = row.diagonal,
      .constant = target.of(0, std::vector<int>(d)),
      .terms = without_conditions ? given_terms(target, row.form, d) : terms(target, d, P),
      .after = {}};
  result.phi.damping = row.damping;
  if (!row.after.empty()) result.after.push_back(equations(row.after, d));
  return result;
}

}  // namespace gradpsi
