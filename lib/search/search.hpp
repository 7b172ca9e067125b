#pragma once

#include <functional>
#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// The neighbours of a few points among all of a cloud's: row k holds those of points[k] within supports[k].
/// Supports are lengths > 0, at most half a periodic box.
using Surroundings =
    std::function<Neighbours(const std::vector<int>& points, const VectorView& supports)>;

/// Builds the tree that they are found in, n log n. The cloud must outlive it.
/// @param length  about which supports are
Surroundings surroundings(const Cloud& cloud, double length, int threads);

}  // namespace gradpsi
