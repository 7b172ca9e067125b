#pragma once

#include <vector>

#include "tolerance/row_choice.hpp"

namespace gradpsi {

/// Exchanges rows where solutions of du/dt = A u grow, see ToleranceOptions::stable.
/// @param fixed  points whose values do not evolve, ascending
/// @throws SolverError  if a solution grows all the same
void make_stable(RowChoice& choice, const std::vector<int>& fixed);

}  // namespace gradpsi
