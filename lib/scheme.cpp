#include "gradpsi/scheme.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

#include "text.hpp"

namespace gradpsi {
namespace {

constexpr auto Gradient = Derivative::Gradient;
constexpr auto Laplacian = Derivative::Laplacian;
using enum Weight;
using enum Consistency;

constexpr std::array<Scheme, 17> table = {{
    {Gradient, Direct, Zoc},
    {Gradient, Direct, Foc},
    {Gradient, Direct, Soc},
    {Gradient, Diffuse, Zoc},
    {Gradient, Diffuse, Foc},
    {Gradient, Diffuse, Soc},
    {Gradient, DiffuseNs, Zoc},
    {Gradient, DiffuseNs, Foc},
    {Gradient, DiffuseNs, Soc},
    {Laplacian, Direct, Zoc},
    {Laplacian, Direct, Soc},
    {Laplacian, Diffuse, Zoc},
    {Laplacian, Diffuse, Soc},
    {Laplacian, DiffuseNs, Zoc},
    {Laplacian, DiffuseNs, Soc},
    {Laplacian, Mixed, Zoc},
    {Laplacian, Mixed, Soc},
}};

template <std::size_t n, class Enum>
std::string_view text(const std::array<std::string_view, n>& names, Enum e) {
  return names.at(static_cast<std::size_t>(e));
}

std::string phi(const Scheme& scheme) {
  static constexpr std::array<std::string_view, 3> gradient = {"(-W'/r)", "(d W/r^2)", "(W/r)"};
  static constexpr std::array<std::string_view, 4> laplacian = {"(W'' + (d-1) W'/r)", "(2d W/r^2)",
                                                                "(2 W/r)", "(-2 W'/r)"};
  const bool first = scheme.derivative == Gradient;
  return std::string(first ? text(gradient, scheme.weight) : text(laplacian, scheme.weight));
}

}  // namespace

std::span<const Scheme> schemes() { return table; }

std::string_view name(Derivative derivative) {
  return text(std::array<std::string_view, 2>{"gradient", "laplacian"}, derivative);
}

std::string_view name(Weight weight) {
  return text(std::array<std::string_view, 4>{"direct", "diffuse", "diffuse-ns", "mixed"}, weight);
}

std::string_view name(Consistency consistency) {
  return text(std::array<std::string_view, 3>{"zoc", "foc", "soc"}, consistency);
}

std::string_view name(Symmetry symmetry) {
  return text(std::array<std::string_view, 3>{"none", "symmetric", "antisymmetric"}, symmetry);
}

std::string name(const Scheme& scheme) {
  return std::string(name(scheme.derivative)) + '-' + std::string(name(scheme.weight)) + '-' +
         std::string(name(scheme.consistency));
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
  const std::string weight = "omega_j " + phi(scheme);
  switch (scheme.consistency) {
    case Zoc: return weight + (first ? " r_ij" : "");
    case Foc: return weight + " B_i r_ij";
    case Soc:
      return weight +
             (first ? " (C0_i r_ij + C1_i : r_ij r_ij)" : " (C0_i : e_ij e_ij + C1_i . r_ij)");
  }
  return {};
}

std::string_view conditions(const Scheme& scheme) {
  if (scheme.consistency == Zoc) return "row sums 0";
  if (scheme.consistency == Foc) return "row sums 0, sum G r = I [4]";
  return scheme.derivative == Gradient ? "row sums 0, sum G r = I [4], sum G r r = 0 [5]"
                                       : "row sums 0, sum psi r = 0 [9], sum psi r r = 2 I [10]";
}

Symmetry symmetry(const Scheme& scheme) {
  if (scheme.consistency != Zoc) return Symmetry::None;
  return scheme.derivative == Gradient ? Symmetry::Antisymmetric : Symmetry::Symmetric;
}

}  // namespace gradpsi
