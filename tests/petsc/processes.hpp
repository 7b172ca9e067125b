#pragma once

#include <gradpsi/petsc.hpp>
#include <limits>
#include <numeric>

#include "clouds.hpp"

namespace gradpsi::petsc {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

inline int rank() {
  int r;
  MPI_Comm_rank(PETSC_COMM_WORLD, &r);
  return r;
}

inline int processes() {
  int count;
  MPI_Comm_size(PETSC_COMM_WORLD, &count);
  return count;
}

/// Where points start.
enum class Start { Blocks, AllOnTheLast, NoneOnTheFirst };

/// The numbers of the points that this process gives.
inline std::vector<int> given_points(int n, Start start) {
  const int all = processes(), last = all - 1;
  int begin = 0, end = 0;
  switch (start) {
    case Start::Blocks:
      begin = n * rank() / all;
      end = n * (rank() + 1) / all;
      break;
    case Start::AllOnTheLast:
      if (rank() == last) end = n;
      break;
    case Start::NoneOnTheFirst:
      if (last == 0) end = n;
      if (rank() > 0) begin = n * (rank() - 1) / last, end = n * rank() / last;
      break;
  }
  std::vector<int> points(end - begin);
  std::iota(points.begin(), points.end(), begin);
  return points;
}

inline Cloud part_of(const Cloud& whole, const std::vector<int>& points) {
  CloudOptions options{.box = whole.box()};
  if (whole.has_volumes()) options.volumes = whole.volumes()(points);
  return Cloud(whole.positions()(points, Eigen::all), options);
}

inline Partition partitioned(const Cloud& whole, Start start = Start::Blocks) {
  return Partition(PETSC_COMM_WORLD, part_of(whole, given_points(whole.size(), start)));
}

/// The numbers of own points.
inline std::vector<int> own_numbers(const Partition& partition) {
  std::vector<int> numbers;
  for (int k = 0; k < partition.cloud().size(); ++k)
    numbers.push_back(static_cast<int>(partition.cloud().number(k)));
  return numbers;
}

/// The numbers of all processes' own points, by rank.
inline std::vector<int> all_numbers(const Partition& partition) {
  const std::vector<int> own = own_numbers(partition);
  int count = static_cast<int>(own.size());
  std::vector<int> counts(processes()), offsets(processes()), all(partition.size());
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, PETSC_COMM_WORLD);
  std::exclusive_scan(counts.begin(), counts.end(), offsets.begin(), 0);
  MPI_Allgatherv(own.data(), count, MPI_INT, all.data(), counts.data(), offsets.data(), MPI_INT,
                 PETSC_COMM_WORLD);
  return all;
}

inline Eigen::VectorXd supports_of(const Partition& partition, const Eigen::VectorXd& supports) {
  return supports.size() == 1 ? supports : Eigen::VectorXd(supports(own_numbers(partition)));
}

}  // namespace gradpsi::petsc
