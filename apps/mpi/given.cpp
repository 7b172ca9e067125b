#include "mpi/given.hpp"

#include <gradpsi/error.hpp>
#include <numeric>
#include <utility>

namespace gradpsi::apps {

namespace {

using petsc::together;

void count(Given& given) {
  const std::int64_t rows = given.table.values.rows();
  given.first = sum_before(rows);
  given.all = reduced(rows, MPI_SUM);
}

void distribute(Given& given, const PointOptions& options) {
  Cloud cloud(Positions(0, 1));
  together(comm(), [&] {
    CloudOptions of_cloud = cloud_options(options, given.table);
    of_cloud.numbers.resize(given.table.values.rows());
    std::iota(of_cloud.numbers.begin(), of_cloud.numbers.end(), given.first);
    cloud = make_cloud(given.table, std::move(of_cloud));
  });
  Extent span = extent(cloud);
  for (double& least : span.least) least = reduced(least, MPI_MIN);
  for (double& most : span.most) most = reduced(most, MPI_MAX);
  given.notes = given.said;
  for (std::string& note : notes(given.table, cloud, span)) given.notes.push_back(std::move(note));
  given.axes = differing_axes(cloud, span);
  cloud = with_axes(cloud, given.axes);
  given.partition.emplace(comm(), cloud);
}

/// Leaves only the first of each group of coincident points.
void drop_duplicates(Given& given) {
  const petsc::Partition& partition = *given.partition;
  Eigen::VectorXd dropped = Eigen::VectorXd::Zero(partition.cloud().size());
  for (const int k : petsc::coincident_points(partition)) dropped[k] = 1;
  const Eigen::VectorXd of_given = partition.to_givers(dropped);
  std::vector<int> kept;
  for (int k = 0; k < of_given.size(); ++k)
    if (of_given[k] == 0) kept.push_back(k);
  given.table = given.table.select(kept);
}

}  // namespace

Given read_share(const PointOptions& options) {
  Given given;
  together(comm(), [&] {
    given.table = read_columns(options.points, options.columns, given.said, rank(), processes());
    if (!given.table.texts.empty())
      throw InvalidInput("column '" + given.table.texts.front().name +
                         "' has texts or whole numbers beyond 2^53, which are for one process");
  });
  count(given);
  distribute(given, options);
  if (options.duplicates != "drop") return given;
  const std::int64_t read = given.all;
  drop_duplicates(given);
  count(given);
  given.dropped = read - given.all;
  distribute(given, options);
  return given;
}

}  // namespace gradpsi::apps
