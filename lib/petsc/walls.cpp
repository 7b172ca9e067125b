#include "petsc/walls.hpp"

#include <algorithm>

#include "petsc/collective.hpp"
#include "petsc/mumps.hpp"
#include "petsc/vectors.hpp"

namespace gradpsi::petsc {
namespace {

Handle<Mat> part_of(Mat A, IS rows, IS columns) {
  Mat part;
  check(MatCreateSubMatrix(A, rows, columns, MAT_INITIAL_MATRIX, &part));
  return Handle<Mat>(part);
}

}  // namespace

WallCorrection::WallCorrection(MPI_Comm comm, Mat A, const std::vector<int>& walls) {
  PetscInt first, end;
  check(MatGetOwnershipRange(A, &first, &end));
  std::vector<PetscInt> numbers;
  for (const int k : walls) numbers.push_back(first + k);
  std::ranges::sort(numbers);
  IS set;
  check(ISCreateGeneral(comm, static_cast<PetscInt>(numbers.size()), numbers.data(),
                        PETSC_COPY_VALUES, &set));
  const Owned<IS> rows(set);
  check(ISCreateStride(comm, end - first, first, 1, &set));
  const Owned<IS> all(set);
  rows_ = part_of(A, rows.get(), all.get());
  among_ = part_of(A, rows.get(), rows.get());
  Vec b, x;
  check(MatCreateVecs(among_.get(), &x, &b));
  residual_.reset(b);
  correction_.reset(x);
  const auto full = vector_like(A);
  VecScatter scatter;
  check(VecScatterCreate(full.get(), rows.get(), b, nullptr, &scatter));
  scatter_.reset(scatter);
  KSP ksp;
  PC pc;
  check(KSPCreate(comm, &ksp));
  ksp_.reset(ksp);
  check(KSPSetOperators(ksp, among_.get(), among_.get()));
  check(KSPSetType(ksp, KSPPREONLY));
  check(KSPGetPC(ksp, &pc));
  set_mumps(comm, pc, false, 0);
  check(KSPSetUp(ksp));
  if (failure_of(comm, pc) != Failed::No) ksp_.reset();  // singular: without, then
}

void WallCorrection::correct(Vec r, Vec z) const {
  if (!ksp_) return;
  check(MatMult(rows_.get(), z, residual_.get()));
  check(VecScale(residual_.get(), -1));
  check(VecScatterBegin(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
  check(KSPSolve(ksp_.get(), residual_.get(), correction_.get()));
  check(VecScatterBegin(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
  check(VecScatterEnd(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
}

}  // namespace gradpsi::petsc
