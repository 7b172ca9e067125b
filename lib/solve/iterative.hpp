#pragma once

#include <memory>

#include "solve/methods.hpp"

namespace gradpsi {

/// Conjugate gradients or BiCGSTAB, preconditioned by multigrid on the points, or by the diagonal or the factor of
/// a twin, either corrected at walls.
std::unique_ptr<PreparedMethod> make_krylov();

}  // namespace gradpsi
