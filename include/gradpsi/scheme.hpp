#pragma once

#include <concepts>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gradpsi/classification.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// A derivative as weighted sums over the neighbours: one row of the table schemes().
///
///     (grad u)_i = sum_j G_ij (u_j - u_i),     (lap u)_i  = sum_j psi_ij (u_j - u_i)
///
/// with r_ij = x_j - x_i, r = |r_ij|, e_ij = r_ij / r. The seventeen schemes of Tables I and II in
/// R. Fatehi, "A new classification and convergence study of SPH-like first and second spatial
/// derivatives schemes", have
///
///     G_ij   = omega_j phi(r) (C0_i r_ij + C1_i : r_ij r_ij)
///     psi_ij = omega_j phi(r) (C0_i : e_ij e_ij + C1_i . r_ij)
///
/// C0 and C1 being what meets the conditions() of the row; without any (zoc) the brackets are r_ij and
/// 1. Their second-order Laplacians turn nearly singular for one-sided neighbourhoods. Those that
/// follow do not:
///
///     soc-ls, ls-P   a_ij = omega_j phi(r) c_i . p(r_ij), p the monomials up to the degree: of all
///                    weights that meet the conditions, those with the least sum a^2 / (omega phi)
///     hessian        the same systems, asked for d^2 u / dx_a dx_b: the trace is the Laplacian's matrix to
///                    rounding; zoc: psi_ij ((d+2) e_a e_b - delta_ab) / 2
///     positive       psi_ij >= 0 with the least sum (r/h)^5 psi_ij, at most d(d+3)/2 of them not zero
///                    (B. Seibold, "Minimal positive stencils in meshfree finite difference methods for
///                    the Poisson equation"); one-sided neighbourhoods have none
///
/// and behind them the systems that the paper cites: see cited.hpp.
struct Scheme {
  Derivative derivative;     ///< what is approximated
  Weight weight;             ///< phi(r)
  Consistency consistency;   ///< the conditions, and how they are met
  int least_squares_degree;  ///< P of ls-P, mls-P and rkpm-P; 0 for the others

  /// Any of these; assemble() refuses what is not one of schemes().
  constexpr Scheme(Derivative derivative, Weight weight, Consistency consistency,
                   int least_squares_degree = 0)
      : derivative(derivative),
        weight(weight),
        consistency(consistency),
        least_squares_degree(least_squares_degree) {}

  /// By name, so that "laplacian-mixed-soc" can stand wherever a scheme is expected, or by the name of
  /// cited_systems().
  /// @throws InvalidInput  listing the valid names, nearest spelling first
  template <std::convertible_to<std::string_view> Name>
  Scheme(const Name& name) : Scheme(from_name(name)) {}

  /// Whether all agree.
  bool operator==(const Scheme&) const = default;

 private:
  static Scheme from_name(std::string_view name);
};

/// All schemes: those of Tables I and II, 9 gradients, then 8 Laplacians, and those that follow them.
std::span<const Scheme> schemes();

/// The seventeen of Tables I and II, the first of schemes().
std::span<const Scheme> classified_schemes();

/// The degree of the polynomials that every row differentiates exactly, 0 to 6; for Laplacians 0 means
/// no more than that constants have none. -1 for gradient-symmetric, whose rows do not sum up to 0.
int degree(const Scheme& scheme);

/// The number of conditions on a row's weights, unknowns of its moment system: the monomials of degree 1
/// to degree(scheme) in d dimensions, binomial(d + P, P) - 1; of laplacian-cspm, d(d+1)/2, those of degree 2.
int unknowns(const Scheme& scheme, int dimension);

/// The support that a scheme brings along, as a multiple of the spacing. ls-P, mls-P and rkpm-P: P + 1/2, at least
/// 2, what the corner of a lattice needs; positive: 5/2. None for the others, where it is the user's choice.
/// @throws InvalidInput  if it is not one of schemes(), as symmetry() does
std::optional<double> support_ratio(const Scheme& scheme);

/// How many supports a row reaches: 1; of laplacian-kgf, which has neighbours of neighbours, 2.
/// @throws InvalidInput  if it is not one of schemes()
int reach(const Scheme& scheme);

/// The name of the consistency, with the degree where there are several: "soc", "ls-3".
std::string consistency_name(const Scheme& scheme);

/// The one spelling used everywhere: derivative-weight-consistency, "gradient-diffuse-ns-foc"; "ls-3",
/// "positive" and what only the cited systems do stand without a weight.
std::string name(const Scheme& scheme);

/// G_ij or psi_ij in plain text, with this scheme's phi(r) written out.
/// @throws InvalidInput  if it is not one of schemes()
std::string formula(const Scheme& scheme);

/// The consistency conditions that every row meets to rounding, with the paper's equation numbers.
std::string_view conditions(const Scheme& scheme);

/// None, or what the table of uncorrected schemes promises.
Symmetry symmetry(const Scheme& scheme);

}  // namespace gradpsi
#pragma GCC visibility pop
