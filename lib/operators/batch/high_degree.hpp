#pragma once

// Vector code; see lanes.hpp.

#include "operators/batch/entries.hpp"

namespace gradpsi {

/// Least squares of degree P >= 3, of W rows: as Row has them, always in two rounds.
template <int D, int P, int W>
void least_squares(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
                   Workspace work);

}  // namespace gradpsi
