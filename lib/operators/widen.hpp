#pragma once

#include "gradpsi/assemble.hpp"
#include "operators/pattern.hpp"

namespace gradpsi {

/// Solves the rows of an operator that are zero with ever larger supports, and reports them anew: policy
/// Widen.
void widen(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
           const AssemblyOptions& options, Operator& op);

}  // namespace gradpsi
