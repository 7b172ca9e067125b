#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// The neighbours of a few points among all of the cloud's: row k holds those of points[k] within
/// supports[k]. A tree is built, n log n. Supports are lengths > 0, at most half a periodic box.
Neighbours neighbours_around(const Cloud& cloud, const std::vector<int>& points,
                             const VectorView& supports, int threads);

}  // namespace gradpsi
