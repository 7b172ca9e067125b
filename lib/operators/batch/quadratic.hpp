#pragma once

// Vector code; see lanes.hpp.

#include "operators/batch/entries.hpp"

namespace gradpsi {

/// Weights without conditions, of W rows.
template <int D, int W>
void uncorrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
                 Workspace work);

/// Weights that meet conditions of up to second order, of W rows: their matrices in registers.
template <int D, int W>
void corrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
               Workspace work);

}  // namespace gradpsi
