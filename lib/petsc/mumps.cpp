#include "petsc/mumps.hpp"

#include <algorithm>
#include <string>

#include "petsc/collective.hpp"

namespace gradpsi::petsc {

void set_mumps(MPI_Comm comm, PC pc, bool cholesky, double memory) {
  Mat factor;
  check(PCSetType(pc, cholesky ? PCCHOLESKY : PCLU));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  // Per cent more workspace than estimated: the usual 20 can be too few.
  check(MatMumpsSetIcntl(factor, 14, 100));
  const double megabytes = memory / processes(comm) / 1e6;
  if (memory == 0 || megabytes > 1e6) return;  // more than any process has
  check(MatMumpsSetIcntl(factor, 23, std::max(1, static_cast<int>(megabytes))));
}

Failed failure_of(MPI_Comm comm, PC pc) {
  PCFailedReason reason;
  check(PCGetFailedReasonRank(pc, &reason));
  auto failed = reason == PC_NOERROR            ? Failed::No
                : reason == PC_FACTOR_OUTMEMORY ? Failed::Memory
                                                : Failed::Singular;
  MatSolverType solver;
  check(PCFactorGetMatSolverType(pc, &solver));
  if (failed == Failed::Singular && solver && std::string(solver) == MATSOLVERMUMPS) {
    Mat factor;
    PetscInt error;
    check(PCFactorGetMatrix(pc, &factor));
    check(MatMumpsGetInfog(factor, 1, &error));
    // MUMPS's user guide, section 8: these are what it calls a lack of memory.
    const auto lacks = {-7, -8, -9, -11, -13, -14, -15, -17, -18, -19, -20};
    if (std::ranges::find(lacks, error) != lacks.end()) failed = Failed::Memory;
  }
  return static_cast<Failed>(largest_of(comm, static_cast<int>(failed)));
}

}  // namespace gradpsi::petsc
