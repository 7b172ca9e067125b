#pragma once

#include <stdexcept>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/spmv.hpp"
#include "multigrid/medium.hpp"

namespace gradpsi {

/// Points of which no coarser ones can be made: why.
struct [[gnu::visibility("default")]] NoHierarchy : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A part of the points of the level before, and the equations on it.
struct CoarseLevel {
  SingleSparseMatrix interpolation;  // from here to the finer level
  SingleSparseMatrix restriction;    // its transpose
  /// See compact.hpp; where the medium jumps, that of the finest level's points restricted to these (Galerkin), as
  /// means of diffusivities would not do: more entries, fewer iterations.
  SingleSparseMatrix matrix;
  DenseVector volumes, masses;  // the points'
};

/// The equations of a level for a changed medium, on the points that there are.
/// @param scale  that they were made with
void renew(CoarseLevel& level, const MediumChange& change, double scale);

/// Coarser and coarser points, to a few hundred. No level at all: of too few.
/// @param cloud     n points with volumes
/// @param medium    n points'
/// @param left_out  n marks: points without an equation, which have no part in the coarser ones
/// @param scale     > 0: of the levels' matrices, which act like `scale` volume times those that the medium is of
/// @throws NoHierarchy  if points coincide, or volumes are no volumes of theirs
std::vector<CoarseLevel> coarser_levels(const Cloud& cloud, const Medium& medium,
                                        const std::vector<char>& left_out, double scale,
                                        int threads);

}  // namespace gradpsi
