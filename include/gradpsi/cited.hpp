#pragma once

#include <span>
#include <string_view>

#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// A system that the paper cites, by its number there. With g = grad W_ij at x_i, W_ab the second derivatives
/// of W, p the monomials of r_ij up to a degree, and \<t\> = sum omega t / sum omega W with j = i in both sums, the
/// rows that the paper's own tables do not have are
///
///     symmetric     omega_j g (u_j + u_i): conserves, converges to nothing
///     normalized    omega_j g_a / sum omega g_a r_a, each component by itself
///     morris        mixed-zoc times r^2 / (r^2 + eta^2), eta = h / 20
///     fpm           omega_j c . (g - <g> W)                     c by the conditions of degree 1
///     icspm         omega_j c . (g, W_ab)                       .. of degree 2, as below
///     msph          omega_j c . (t - <t> W), t = (g, W_ab)
///     mls-P         omega_j W c . (p - <W p>)                   .. of degree P: u_i is fitted like the others
///     rkpm-P        d/dx, d^2/dx^2 of N_j = omega_j W b(x) . p_1, (sum omega W p_1 p_1^T) b = (1, 0, ..), p_1 = (1, p)
///     cspm          omega_j c : W_ab less its first moments times gradient-direct-foc
///     kgf           sum_a G_a G_a, G = gradient-mls-1: neighbours of neighbours
///     kgf-improved  omega_j 2d W / r^2 / sum_{k /= i} omega_k W, less its first moments times gradient-mls-1
struct CitedSystem {
  std::string_view reference;  ///< "[12]"
  std::string_view name;       ///< what Scheme takes for it: a scheme's own, or another one
  std::string_view who;        ///< whose it is, or what it is called
  std::string_view equal_to;   ///< the scheme that it is by another name, or nothing
};

/// All of them, by number.
std::span<const CitedSystem> cited_systems();

}  // namespace gradpsi
#pragma GCC visibility pop
