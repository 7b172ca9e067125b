#pragma once

#include <Eigen/Core>
#include <string>

#include "gradpsi/dense.hpp"
#include "gradpsi/diffusion.hpp"

namespace gradpsi {

/// " at point 17"
std::string at_point(const Cloud& cloud, int i);

/// Throw InvalidInput unless numbers are in their ranges and sizes those of the cloud.
void check_time_step(double time_step, double theta);
/// For a damped step.
[[gnu::visibility("default")]] void check_damping(double theta);  // gradpsi::petsc calls it, too
void check(const DiffusionOptions& options, int points);
void check(const Cloud& cloud, const Operator& laplacian);
void check(const BoundaryConditions& conditions, const Cloud& cloud);

/// Rows transfer u + n . grad u of the wall points: as many x n.
SparseMatrix wall_rows(const WallConditions& walls, int points);

/// The largest entry of a wall's row, with the sign of its diagonal.
/// @throws InvalidInput  if that is zero or not finite
double size_of_row(const SparseMatrix& rows, int k, const Cloud& cloud, int point);

/// How two solves went, one after the other.
[[gnu::visibility("default")]] SolveReport both(const SolveReport& first,
                                                const SolveReport& second);

}  // namespace gradpsi
