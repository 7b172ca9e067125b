#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// The points around probes, which need not be points of the cloud: row k has those within the support of
/// probe k, ascending, one where the probe is among them. A probe's support is that of the point nearest to
/// it. Cost: one pass over the points, n' log n' for the n' among them that are in the probes' box widened by the
/// largest support, O(log n' + neighbours) for each probe.
///
/// @param cloud     n points
/// @param probes    m x d, in the same periodic box
/// @param supports  n lengths > 0, or one for all
/// @return  m rows, and as many supports
/// @throws InvalidInput  as find_neighbours(), though not for coincident points; if a probe's coordinate is not
///   finite, or d is another one; naming probes that are farther from all points than half the support
Neighbours neighbours_of_probes(const Cloud& cloud, const Positions& probes,
                                const VectorView& supports, int threads);

/// The same with supports a tenth larger than the distance of the counts[k]-th nearest point of probe k, in
/// periodic directions at most half the box.
/// @param counts   m, each >= 1; of fewer points there are all
/// @throws InvalidInput  likewise, but probes that far are refused only if they are also farther from their nearest
///   point than that is from its (3 (d + 1))-th nearest
Neighbours nearest_to_probes(const Cloud& cloud, const Positions& probes,
                             const std::vector<int>& counts, int threads);

}  // namespace gradpsi
