#pragma once

#include <cmath>
#include <limits>

// How right-hand sides of any size are solved alike, on one machine and on several processes.
namespace gradpsi {

/// The power of 2 in whose units what is at most `largest` is about 1, so that its square neither overflows
/// nor vanishes.
inline int unit_of(double largest) { return largest > 0 ? std::ilogb(largest) : 0; }

/// Whether b - A x of 2-norm `norm` is below the tolerance relative to that of b, `size`, or as small as
/// rounding lets it be.
/// @param size_of_terms  gives the 2-norm of |b| + |A| |x|, which rounding is relative to
template <class F>
bool is_solved(double norm, double size, double tolerance, const F& size_of_terms) {
  if (!std::isfinite(norm)) return false;
  if (norm <= tolerance * size) return true;
  if (norm > 1e-4 * size) return false;  // no rounding error of a matrix worth solving with
  return norm <= 8 * std::numeric_limits<double>::epsilon() * size_of_terms();
}

}  // namespace gradpsi
