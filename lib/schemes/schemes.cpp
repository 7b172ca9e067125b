#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/scheme.hpp"

namespace gradpsi {
namespace {

constexpr auto Gradient = Derivative::Gradient;
constexpr auto Laplacian = Derivative::Laplacian;
using Weight::Diffuse, Weight::DiffuseNs, Weight::Direct, Weight::Distance, Weight::Mixed;
using enum Consistency;

constexpr std::size_t classified = 17;
constexpr std::array<Scheme, classified + 15> table = {{
    {Gradient, Direct, Zoc},          {Gradient, Direct, Foc},
    {Gradient, Direct, Soc},          {Gradient, Diffuse, Zoc},
    {Gradient, Diffuse, Foc},         {Gradient, Diffuse, Soc},
    {Gradient, DiffuseNs, Zoc},       {Gradient, DiffuseNs, Foc},
    {Gradient, DiffuseNs, Soc},       {Laplacian, Direct, Zoc},
    {Laplacian, Direct, Soc},         {Laplacian, Diffuse, Zoc},
    {Laplacian, Diffuse, Soc},        {Laplacian, DiffuseNs, Zoc},
    {Laplacian, DiffuseNs, Soc},      {Laplacian, Mixed, Zoc},
    {Laplacian, Mixed, Soc},          {Laplacian, Diffuse, SocLs},
    {Laplacian, DiffuseNs, SocLs},    {Laplacian, Mixed, SocLs},
    {Laplacian, Distance, Positive},  {Gradient, Weight::Kernel, Ls1},
    {Gradient, Weight::Kernel, Ls2},  {Gradient, Weight::Kernel, Ls3},
    {Gradient, Weight::Kernel, Ls4},  {Gradient, Weight::Kernel, Ls5},
    {Gradient, Weight::Kernel, Ls6},  {Laplacian, Weight::Kernel, Ls2},
    {Laplacian, Weight::Kernel, Ls3}, {Laplacian, Weight::Kernel, Ls4},
    {Laplacian, Weight::Kernel, Ls5}, {Laplacian, Weight::Kernel, Ls6},
}};

template <std::size_t n, class Enum>
std::string_view text(const std::array<std::string_view, n>& names, Enum e) {
  return names.at(static_cast<std::size_t>(e));
}

std::string phi(const Scheme& scheme) {
  if (scheme.weight == Weight::Kernel) return "W";
  static constexpr std::array<std::string_view, 3> gradient = {"(-W'/r)", "(d W/r^2)", "(W/r)"};
  static constexpr std::array<std::string_view, 4> laplacian = {"(W'' + (d-1) W'/r)", "(2d W/r^2)",
                                                                "(2 W/r)", "(-2 W'/r)"};
  const bool first = scheme.derivative == Gradient;
  return std::string(first ? text(gradient, scheme.weight) : text(laplacian, scheme.weight));
}

}  // namespace

std::span<const Scheme> schemes() { return table; }

std::span<const Scheme> classified_schemes() { return schemes().first(classified); }

int degree(const Scheme& scheme) {
  switch (scheme.consistency) {
    case Zoc: return 0;
    case Foc: return 1;
    case Soc:
    case SocLs:
    case Positive: return 2;
    default: return 1 + static_cast<int>(scheme.consistency) - static_cast<int>(Ls1);
  }
}

int unknowns(const Scheme& scheme, int dimension) {
  int monomials = 1;  // up to the degree, the constant one among them
  for (int a = 1; a <= dimension; ++a) monomials = monomials * (degree(scheme) + a) / a;
  return monomials - 1;
}

std::optional<double> support_ratio(const Scheme& scheme) {
  if (scheme.consistency == Positive) return 2.5;
  if (scheme.weight == Weight::Kernel) return std::max(2.0, degree(scheme) + 0.5);
  return std::nullopt;
}

std::string_view name(Derivative derivative) {
  return text(std::array<std::string_view, 2>{"gradient", "laplacian"}, derivative);
}

std::string_view name(Weight weight) {
  return text(std::array<std::string_view, 6>{"direct", "diffuse", "diffuse-ns", "mixed", "kernel",
                                              "distance"},
              weight);
}

std::string_view name(Consistency consistency) {
  return text(std::array<std::string_view, 11>{"zoc", "foc", "soc", "soc-ls", "positive", "ls-1",
                                               "ls-2", "ls-3", "ls-4", "ls-5", "ls-6"},
              consistency);
}

std::string_view name(Symmetry symmetry) {
  return text(std::array<std::string_view, 3>{"none", "symmetric", "antisymmetric"}, symmetry);
}

std::string name(const Scheme& scheme) {
  std::string result = std::string(name(scheme.derivative)) + '-';
  if (scheme.weight < Weight::Kernel) result += std::string(name(scheme.weight)) + '-';
  return result + std::string(name(scheme.consistency));
}

Scheme Scheme::from_name(std::string_view wanted) {
  const auto found = std::ranges::find_if(table, [&](const auto& s) { return name(s) == wanted; });
  if (found != table.end()) return *found;
  std::vector<std::string> valid;
  std::ranges::transform(table, std::back_inserter(valid), [](const auto& s) { return name(s); });
  throw_unknown("scheme", wanted, valid);
}

std::string formula(const Scheme& scheme) {
  static_cast<void>(Scheme(name(scheme)));  // throws unless it is one of schemes()
  const bool first = scheme.derivative == Gradient;
  if (scheme.consistency == Positive) return ">= 0, least sum (r/h)^5 psi_ij";
  const std::string weight = "omega_j " + phi(scheme);
  switch (scheme.consistency) {
    case Zoc: return weight + (first ? " r_ij" : "");
    case Foc: return weight + " B_i r_ij";
    case Soc:
      return weight +
             (first ? " (C0_i r_ij + C1_i : r_ij r_ij)" : " (C0_i : e_ij e_ij + C1_i . r_ij)");
    default: return weight + " c_i . p(r_ij)";
  }
}

std::string_view conditions(const Scheme& scheme) {
  static constexpr std::array<std::string_view, 7> exact = {"row sums 0",
                                                            "row sums 0, sum G r = I [4]",
                                                            "",
                                                            "exact on polynomials of degree 3",
                                                            "exact on polynomials of degree 4",
                                                            "exact on polynomials of degree 5",
                                                            "exact on polynomials of degree 6"};
  if (degree(scheme) != 2) return text(exact, degree(scheme));
  return scheme.derivative == Gradient ? "row sums 0, sum G r = I [4], sum G r r = 0 [5]"
                                       : "row sums 0, sum psi r = 0 [9], sum psi r r = 2 I [10]";
}

Symmetry symmetry(const Scheme& scheme) {
  if (scheme.consistency != Zoc) return Symmetry::None;
  return scheme.derivative == Gradient ? Symmetry::Antisymmetric : Symmetry::Symmetric;
}

}  // namespace gradpsi
