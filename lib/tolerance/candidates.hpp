#pragma once

#include <vector>

#include "gradpsi/scheme.hpp"

namespace gradpsi {

/// What is tried for a row: a scheme on the nearest points.
struct RowCandidate {
  Scheme scheme;
  int neighbours;  // as many at least
};

/// In the order of what a product with them costs.
/// @param stable  whether fields must not grow: positive stencils, by which they do not, look further for points on
///   all sides
std::vector<RowCandidate> row_candidates(Derivative derivative, int dimension, bool stable);

/// A support with that many points reaches this much further than the last of them, whose weight would be 0.
inline constexpr double beyond_last = 1.15;

}  // namespace gradpsi
