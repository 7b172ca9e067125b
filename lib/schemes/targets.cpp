#include "schemes/targets.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/dispatch.hpp"
#include "schemes/monomials.hpp"

namespace gradpsi {
namespace {

std::string axis_name(int axis) { return std::string(1, "xyz"[axis]); }

int sum(std::span<const int> powers) { return std::accumulate(powers.begin(), powers.end(), 0); }

/// The axes of a component of a symmetric tensor, its upper triangle row by row.
std::pair<int, int> pair(int d, int output) {
  int a = 0;
  for (; output >= d - a; ++a) output -= d - a;
  return {a, a + output};
}

// In the order of Derivative.
constexpr std::array<Target, 4> table = {{
    {"gradient",
     1,
     {"row sums 0", "row sums 0, sum G r = I [4]",
      "row sums 0, sum G r = I [4], sum G r r = 0 [5]"},
     [](int d) { return d; },
     [](int, int output) { return axis_name(output); },
     [](int output, std::span<const int> powers) {
       return sum(powers) == 1 ? 1.0 * powers[output] : 0.0;
     }},
    {"laplacian",
     2,
     {"row sums 0", "row sums 0, sum psi r = 0 [9]",
      "row sums 0, sum psi r = 0 [9], sum psi r r = 2 I [10]"},
     [](int) { return 1; },
     [](int, int) { return std::string(); },
     [](int, std::span<const int> powers) {
       return sum(powers) == 2 && std::ranges::max(powers) == 2 ? 2.0 : 0.0;
     }},
    {"hessian",
     2,
     {"row sums 0", "row sums 0, sum H r = 0",
      "row sums 0, sum H r = 0, sum H_ab r_c r_d = d_ac d_bd + d_ad d_bc"},
     [](int d) { return d * (d + 1) / 2; },
     [](int d, int output) {
       const auto [a, b] = pair(d, output);
       return axis_name(a) + axis_name(b);
     },
     [](int output, std::span<const int> powers) {
       const auto [a, b] = pair(static_cast<int>(powers.size()), output);
       if (sum(powers) != 2) return 0.0;
       return a == b ? powers[a] / 2 * 2.0 : 1.0 * powers[a] * powers[b];
     }},
    {"value",
     0,
     {"row sums 1", "row sums 1, sum a r = 0", "row sums 1, sum a r = 0, sum a r r = 0"},
     [](int) { return 1; },
     [](int, int) { return std::string(); },
     [](int, std::span<const int> powers) { return sum(powers) == 0 ? 1.0 : 0.0; }},
}};

}  // namespace

const Target& target(Derivative derivative) {
  return table.at(static_cast<std::size_t>(derivative));
}

std::string_view name(Derivative derivative) { return target(derivative).name; }

int order(Derivative derivative) { return target(derivative).order; }

std::vector<std::string> components(Derivative derivative, int dimension) {
  const Target& row = target(derivative);
  std::vector<std::string> result(row.outputs(dimension));
  for (int o = 0; o < std::ssize(result); ++o) result[o] = row.component(dimension, o);
  return result;
}

std::vector<Term> given_terms(const Target& target, Form form, int d) {
  if (form == Form::Constant) return {{0, 0, 1}};
  if (form == Form::Monomials) return terms(target, d, 1);
  // P. Espanol, M. Revenga, Phys. Rev. E 67, 026705 (2003), with delta_ab = delta_ab sum_c e_c e_c: the trace is
  // phi, as it is for the Laplacian.
  std::vector<Term> result;
  for (int o = 0; o < target.outputs(d); ++o) {
    const auto [a, b] = pair(d, o);
    result.push_back({o, d + o, (d + 2) / 2.0});
    for (int c = 0; a == b && c < d; ++c) result.push_back({o, d + c * d - c * (c - 1) / 2, -0.5});
  }
  return result;
}

std::vector<Term> terms(const Target& target, int dimension, int degree) {
  return dispatch(dimension, [&](auto d) {
    constexpr const auto& monomials = monomial_table<d, highest_degree>;
    std::vector<Term> result;
    for (int m = 0; m < monomials_to(d, degree); ++m)
      for (int o = 0; o < target.outputs(d); ++o)
        if (const double value = target.of(o, {monomials.powers[m], d}); value != 0)
          result.push_back({o, m, value});
    return result;
  });
}

}  // namespace gradpsi
