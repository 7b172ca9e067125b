#pragma once

#include <cstdint>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/petsc_partition.hpp"

namespace gradpsi::petsc {

/// A point of the halo.
struct Outsider {
  std::int64_t number;
  PetscSFNode owner;
};

/// The points of other processes in boxes of `reach` around own ones, by ascending number: their owners are asked.
/// @param x  own points, in their box
std::vector<Outsider> halo(const Partition& partition, const Positions& x, const VectorView& reach);

}  // namespace gradpsi::petsc
