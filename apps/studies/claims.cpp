#include "studies/claims.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gradpsi::apps::converge {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr auto first = Derivative::Gradient, second = Derivative::Laplacian;
constexpr auto zoc = Consistency::Zoc, foc = Consistency::Foc, soc = Consistency::Soc;
constexpr auto regular = Arrangement::Regular, irregular = Arrangement::Irregular;

}  // namespace

std::span<const Claim> claims() {
  static constexpr std::array all = {
      Claim{"zoc, first, regular: no convergence", first, zoc, regular, -infinity, 0.5},
      Claim{"zoc, first, irregular: no convergence", first, zoc, irregular, -infinity, 0.5},
      Claim{"zoc, second, regular: no convergence", second, zoc, regular, -infinity, 0.5},
      Claim{"zoc, second, irregular: the error grows", second, zoc, irregular, -infinity, -0.5},
      Claim{"foc, first, regular: order between 1 and 2", first, foc, regular, 0.9, 2.1},
      Claim{"foc, first, irregular: order between 1 and 2", first, foc, irregular, 0.9, 2.1},
      Claim{"soc, first, regular: order 2", first, soc, regular, 1.8, 2.2},
      Claim{"soc, first, irregular: order 2", first, soc, irregular, 1.8, 2.2},
      Claim{"soc, second, regular: order 2", second, soc, regular, 1.8, 2.5},
      Claim{"soc, second, irregular: order 1", second, soc, irregular, 0.8, 1.5},
  };
  return all;
}

Observation observation(const Claim& claim, const std::vector<Curve>& curves, Error error) {
  Observation seen{.least = infinity, .most = -infinity, .exceptions = {}};
  for (const Curve& curve : curves) {
    const Result& r = curve.front();
    const double order = fitted_order(curve, error);
    if (r.scheme.derivative != claim.derivative || r.scheme.consistency != claim.consistency ||
        r.arrangement != claim.arrangement || std::isnan(order))
      continue;
    seen.least = std::min(seen.least, order), seen.most = std::max(seen.most, order);
    ++seen.of;
    if (order >= claim.least && order <= claim.most)
      ++seen.observed;
    else
      seen.exceptions.insert(name(r.scheme.weight));
  }
  return seen;
}

Rounding rounding(const std::vector<Curve>& curves, Error error) {
  Rounding found{.smallest = infinity};
  for (const Curve& curve : curves) {
    const Scheme& s = curve.front().scheme;
    if (s.derivative != second || s.consistency != soc) continue;
    double least = infinity;
    for (const Result& r : curve)
      if (r.*error < least) least = r.*error;  // false for NaN
    found.risen += curve.back().*error > 2 * least;
    found.smallest = std::min(found.smallest, curve.back().spacing);
    ++found.of;
  }
  return found;
}

}  // namespace gradpsi::apps::converge
