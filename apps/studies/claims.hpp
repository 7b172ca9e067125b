#pragma once

#include <set>
#include <string_view>
#include <vector>

#include "studies/converge.hpp"

// The conclusions of the paper, and how much of them is seen in curves of errors.

namespace gradpsi::apps::converge {

/// Curves of a kind, and the range that their fitted order must lie in.
struct Claim {
  std::string_view text;
  Derivative derivative;
  Consistency consistency;
  Arrangement arrangement;
  double least, most;
};

/// "No convergence" allows order 1/2: the L2 norm of an error that stays O(1) in a boundary layer of width
/// h falls that fast.
std::span<const Claim> claims();

/// What curves show of a claim.
struct Observation {
  int observed = 0, of = 0;               ///< curves
  double least, most;                     ///< their orders; infinity and -infinity without curves
  std::set<std::string_view> exceptions;  ///< weights of the curves that contradict
};
Observation observation(const Claim& claim, const std::vector<Curve>& curves, Error error);

/// Rounding at small spacings, in second derivatives of second order.
struct Rounding {
  int risen = 0, of = 0;  ///< curves; risen: whose last error is well above their least
  double smallest;        ///< spacing

  bool reached() const { return risen > 0 || smallest < 1e-5; }
};
Rounding rounding(const std::vector<Curve>& curves, Error error);

}  // namespace gradpsi::apps::converge
