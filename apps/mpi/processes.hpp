#pragma once

#include <mpi.h>
#include <petscsys.h>

#include <cstdint>
#include <numeric>
#include <type_traits>
#include <vector>

// What the processes of gradpsi-mpi tell one another.

namespace gradpsi::apps {

inline MPI_Comm comm() { return PETSC_COMM_WORLD; }

inline int rank() {
  int rank;
  MPI_Comm_rank(comm(), &rank);
  return rank;
}

inline int processes() {
  int count;
  MPI_Comm_size(comm(), &count);
  return count;
}

/// One value from those of all processes, by MPI_SUM, MPI_MIN or MPI_MAX.
inline double reduced(double value, MPI_Op operation) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, operation, comm());
  return value;
}
inline std::int64_t reduced(std::int64_t value, MPI_Op operation) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT64_T, operation, comm());
  return value;
}

/// The sum of the values of lower ranks.
inline std::int64_t sum_before(std::int64_t value) {
  std::int64_t result = 0;
  MPI_Exscan(&value, &result, 1, MPI_INT64_T, MPI_SUM, comm());
  return rank() == 0 ? 0 : result;
}

/// The values of all processes, by rank, in the first one; in the others nothing.
template <class T>
std::vector<T> gathered(const std::vector<T>& here) {
  static_assert(std::is_trivially_copyable_v<T>);
  const int bytes = static_cast<int>(here.size() * sizeof(T));
  std::vector<int> sizes(processes()), offsets(processes());
  MPI_Gather(&bytes, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, comm());
  std::exclusive_scan(sizes.begin(), sizes.end(), offsets.begin(), 0);
  std::vector<T> all(rank() == 0 ? (offsets.back() + sizes.back()) / sizeof(T) : 0);
  MPI_Gatherv(here.data(), bytes, MPI_BYTE, all.data(), sizes.data(), offsets.data(), MPI_BYTE, 0,
              comm());
  return all;
}

}  // namespace gradpsi::apps
