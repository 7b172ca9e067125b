#pragma once

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// Throws InvalidInput unless `near` can be the neighbours of `cloud`'s points, which have not moved further
/// than its skin allows.
void check_match(const Cloud& cloud, const Neighbours& near, int threads);

/// Half the smallest length of a periodic box; infinity without one.
double largest_support(const Cloud& cloud);

/// Throws InvalidInput unless there is one support for all or one for each point, each > 0, finite, at most
/// half a periodic box and not 145 orders below another.
void check_supports(const Cloud& cloud, const VectorView& supports);

}  // namespace gradpsi
