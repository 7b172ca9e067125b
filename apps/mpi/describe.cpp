#include "mpi/describe.hpp"

#include <algorithm>
#include <limits>

#include "common/operators.hpp"
#include "mpi/processes.hpp"

namespace gradpsi::apps {

namespace {

NeighbourCounts neighbour_counts(const petsc::Subdomain& mine, const Neighbours& near) {
  if (mine.partition().size() == 0) return {};
  Eigen::VectorXd counts(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < counts.size(); ++k) counts[k] = near.count(mine.own()[k]);
  const bool none = counts.size() == 0;
  const double least = none ? std::numeric_limits<double>::max() : counts.minCoeff();
  const double most = none ? 0 : counts.maxCoeff();
  return {static_cast<int>(reduced(least, MPI_MIN)), petsc::median(comm(), counts),
          static_cast<int>(reduced(most, MPI_MAX))};
}

/// The degenerate rows of all processes, by number; of very many only some are listed.
DegenerateRows all_degenerate_rows(const Operator& op, const Cloud& cloud) {
  constexpr std::size_t most = 1'000'000;
  DegenerateRows result = degenerate_rows(op, cloud);
  for (std::int64_t* count : {&result.lowered, &result.widened, &result.zero})
    *count = reduced(*count, MPI_SUM);
  result.rows.resize(std::min(result.rows.size(), most / processes()));
  result.rows = gathered(result.rows);
  std::ranges::sort(result.rows, {}, &DegenerateRow::point);
  return result;
}

/// Of all processes, with the number of its point.
std::optional<WorstRow> worst_row(const Operator& op, const petsc::Subdomain& mine) {
  constexpr auto none = std::numeric_limits<std::int64_t>::max();
  double least = std::numeric_limits<double>::infinity();
  std::int64_t point = none;
  if (Eigen::Index row; op.rows.reciprocal_condition.size() > 0) {
    least = op.rows.reciprocal_condition.minCoeff(&row);
    point = mine.cloud().number(mine.own()[row]);
  }
  const double least_of_all = reduced(least, MPI_MIN);
  point = reduced(least == least_of_all ? point : none, MPI_MIN);
  if (point == none) return std::nullopt;
  return WorstRow{least_of_all, point};
}

}  // namespace

void describe_together(const Operator& op, const petsc::Subdomain& mine, const Neighbours& near,
                       Report& report) {
  report.entries = reduced(std::int64_t{op.matrix().nonZeros()}, MPI_SUM);
  report.neighbours = neighbour_counts(mine, near);
  report.degenerate = all_degenerate_rows(op, mine.cloud());
  report.degenerate_rows = report.degenerate.count();
  report.worst = worst_row(op, mine);
}

}  // namespace gradpsi::apps
