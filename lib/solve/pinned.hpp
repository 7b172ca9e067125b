#pragma once

#include <memory>

#include "solve/methods.hpp"

namespace gradpsi {

/// Solves A x + c = b for x and the number c where constants, and nothing else, are in A's null space: one unknown
/// is held at 0 and its row left out, which `method`, a factorisation, can solve; c is such that that row holds, too.
/// x is then shifted to SolverOptions::mean.
std::unique_ptr<PreparedMethod> pinned(std::unique_ptr<PreparedMethod> method);

}  // namespace gradpsi
