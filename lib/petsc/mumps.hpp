#pragma once

#include <petscksp.h>

namespace gradpsi::petsc {

/// MUMPS's factors as a preconditioner. `memory`: bytes for all processes, 0: as many as it takes.
void set_mumps(MPI_Comm comm, PC pc, bool cholesky, double memory);

/// Whether a preconditioner's set-up failed in any process, and why.
enum class Failed { No, Singular, Memory };
Failed failure_of(MPI_Comm comm, PC pc);

}  // namespace gradpsi::petsc
