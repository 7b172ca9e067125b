#pragma once

#include <mpi.h>
#include <petscsys.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gradpsi/dense.hpp"

namespace gradpsi::petsc {

inline int rank_of(MPI_Comm comm) {
  int rank;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

inline int processes(MPI_Comm comm) {
  int count;
  MPI_Comm_size(comm, &count);
  return count;
}

template <class T>
MPI_Datatype type_of();
template <>
inline MPI_Datatype type_of<double>() {
  return MPI_DOUBLE;
}
template <>
inline MPI_Datatype type_of<int>() {
  return MPI_INT;
}
template <>
inline MPI_Datatype type_of<std::int64_t>() {
  return MPI_INT64_T;
}

/// One value from the values of all processes.
template <class T>
T reduced(MPI_Comm comm, T value, MPI_Op operation) {
  T result;
  MPI_Allreduce(&value, &result, 1, type_of<T>(), operation, comm);
  return result;
}
template <class T>
T sum_of(MPI_Comm comm, T value) {
  return reduced(comm, value, MPI_SUM);
}
template <class T>
T least_of(MPI_Comm comm, T value) {
  return reduced(comm, value, MPI_MIN);
}
template <class T>
T largest_of(MPI_Comm comm, T value) {
  return reduced(comm, value, MPI_MAX);
}
inline bool anywhere(MPI_Comm comm, bool here) { return largest_of(comm, int{here}) != 0; }

/// The values of all processes, by rank.
template <class T>
std::vector<T> gathered(MPI_Comm comm, T value) {
  std::vector<T> all(processes(comm));
  MPI_Allgather(&value, 1, type_of<T>(), all.data(), 1, type_of<T>(), comm);
  return all;
}

/// The sum of the values of lower ranks.
template <class T>
T sum_before(MPI_Comm comm, T value) {
  T result{};
  MPI_Exscan(&value, &result, 1, type_of<T>(), MPI_SUM, comm);
  return rank_of(comm) == 0 ? T{} : result;
}

/// The middle two of all processes' values, at least one; of an odd number of them the middle one twice.
std::pair<double, double> middle_two(MPI_Comm comm, const VectorView& values);

/// Throws what PETSc says of an error.
void check(PetscErrorCode code);

}  // namespace gradpsi::petsc
