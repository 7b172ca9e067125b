#pragma once

#include <vector>

#include "gradpsi/petsc.hpp"

namespace gradpsi::petsc {

/// A square MATMPIAIJ of this process's rows, whose columns have these numbers among those of all.
Handle<Mat> make_matrix(MPI_Comm comm, const SparseMatrix& rows,
                        const std::vector<PetscInt>& columns);

}  // namespace gradpsi::petsc
