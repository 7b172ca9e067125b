#pragma once

#include <vector>

#include "gradpsi/petsc_partition.hpp"

namespace gradpsi::petsc {

/// The images in the box of a periodic cloud's points: where they are looked for.
Positions in_box(const Cloud& cloud);

/// Throws unless there is a row of values for each of `wanted` points.
void check_row_count(MPI_Comm comm, Eigen::Index rows, Eigen::Index wanted);

/// A star forest: leaf k, at places[k] or k, is element indices[k] of process ranks[k], which has `roots`.
Handle<PetscSF> star_forest(MPI_Comm comm, int roots, const std::vector<PetscInt>* places,
                            const std::vector<PetscSFNode>& leaves);

}  // namespace gradpsi::petsc
