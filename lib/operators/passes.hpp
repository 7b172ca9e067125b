#pragma once

#include "gradpsi/assemble.hpp"

namespace gradpsi {

/// The Laplacian sum_a G_a G_a of a gradient. Its rows have neighbours of neighbours. A row is as its gradient's
/// rows are, its own and its neighbours': zero if one of them is zero, else with the lowest degree and the
/// least reciprocal condition number among them. Degenerate rows of the gradient are as the policy has them.
/// @throws StencilError  for the first degenerate row (policy Fail)
Operator two_passes(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                    const AssemblyOptions& options);

}  // namespace gradpsi
