#pragma once

#include "gradpsi/dense.hpp"
#include "gradpsi/petsc_partition.hpp"
#include "petsc/collective.hpp"

namespace gradpsi::petsc {

/// A vector with the layout of A's rows.
inline Handle<Vec> vector_like(Mat A) {
  Vec v;
  check(MatCreateVecs(A, nullptr, &v));
  return Handle<Vec>(v);
}

/// Calls f(k, v_k) for this process's part of a vector, which it may change.
template <class F>
void for_each_entry(Vec v, const F& f) {
  PetscInt count;
  double* values;
  check(VecGetLocalSize(v, &count));
  check(VecGetArray(v, &values));
  for (PetscInt k = 0; k < count; ++k) f(k, values[k]);
  check(VecRestoreArray(v, &values));
}

/// Whether diag(scale) A is symmetric, that is x . scale A y = y . scale A x for two arbitrary vectors:
/// comparing entries would take rows of others.
bool is_symmetric(Mat A, const VectorView& scale);

/// y = |A| |x|, entry by entry.
void multiply_magnitudes(Mat A, Vec x, Vec y);

}  // namespace gradpsi::petsc
