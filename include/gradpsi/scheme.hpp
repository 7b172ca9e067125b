#pragma once

#include <concepts>
#include <span>
#include <string>
#include <string_view>

namespace gradpsi {

enum class Derivative { Gradient, Laplacian };

/// Which phi(r) weighs a neighbour (Tables I and II), with W the kernel and d the dimension.
enum class Weight {
  Direct,     ///< gradient -W'/r, Laplacian W'' + (d-1) W'/r
  Diffuse,    ///< gradient d W/r^2, Laplacian 2d W/r^2
  DiffuseNs,  ///< gradient W/r, Laplacian 2 W/r; without correction a power of length is missing
  Mixed       ///< Laplacian -2 W'/r
};

/// Consistency of zeroth, first (gradients only) or second order: exact on polynomials of that degree.
enum class Consistency { Zoc, Foc, Soc };

/// One of the seventeen schemes of Tables I and II in R. Fatehi, "A new classification and convergence
/// study of SPH-like first and second spatial derivatives schemes":
///
///     (grad u)_i = sum_j G_ij (u_j - u_i),     G_ij   = omega_j phi(r) (C0_i r_ij + C1_i : r_ij r_ij)
///     (lap u)_i  = sum_j psi_ij (u_j - u_i),   psi_ij = omega_j phi(r) (C0_i : e_ij e_ij + C1_i . r_ij)
///
/// with r_ij = x_j - x_i, r = |r_ij|, e_ij = r_ij / r. C0 and C1 are what meets the conditions() of the
/// row; without any (zoc) the brackets are r_ij and 1.
struct Scheme {
  Derivative derivative;
  Weight weight;
  Consistency consistency;

  constexpr Scheme(Derivative derivative, Weight weight, Consistency consistency)
      : derivative(derivative), weight(weight), consistency(consistency) {}

  /// By name, so that "laplacian-mixed-soc" can stand wherever a scheme is expected.
  /// @throws InvalidInput  listing the valid names, nearest spelling first
  template <std::convertible_to<std::string_view> Name>
  Scheme(const Name& name) : Scheme(from_name(name)) {}

  bool operator==(const Scheme&) const = default;

 private:
  static Scheme from_name(std::string_view name);
};

/// All schemes: 9 gradients, then 8 Laplacians, in the order of Tables I and II.
std::span<const Scheme> schemes();

std::string_view name(Derivative derivative);    ///< "gradient", "laplacian"
std::string_view name(Weight weight);            ///< "direct", "diffuse", "diffuse-ns", "mixed"
std::string_view name(Consistency consistency);  ///< "zoc", "foc", "soc"

/// The one spelling used everywhere: derivative-weight-consistency, "gradient-diffuse-ns-foc".
std::string name(const Scheme& scheme);

/// G_ij or psi_ij in plain text, with this scheme's phi(r) written out.
/// @throws InvalidInput  if it is not one of schemes()
std::string formula(const Scheme& scheme);

/// The consistency conditions that every row meets to rounding, with the paper's equation numbers.
std::string_view conditions(const Scheme& scheme);

/// What holds for the off-diagonal entries scaled by the row's volume, given one support for all.
enum class Symmetry {
  None,
  Symmetric,     ///< omega_i a_ij = omega_j a_ji: zoc Laplacians
  Antisymmetric  ///< omega_i a_ij = -omega_j a_ji: zoc gradients
};
Symmetry symmetry(const Scheme& scheme);
std::string_view name(Symmetry symmetry);  ///< "none", "symmetric", "antisymmetric"

}  // namespace gradpsi
