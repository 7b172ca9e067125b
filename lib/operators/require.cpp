#include <algorithm>

#include "operators/degenerate.hpp"

namespace gradpsi {

void require(const Scheme& scheme, const Cloud& cloud, const Operator& op,
             std::vector<int> except) {
  std::ranges::sort(except);
  std::vector<int> points, rows;  // of the degenerate rows
  for (int k = 0; k < static_cast<int>(op.rows.outcome.size()); ++k) {
    const int point = op.points.empty() ? k : op.points[k];
    if (op.rows.outcome[k] == RowOutcome::AsAsked || std::ranges::binary_search(except, point))
      continue;
    points.push_back(point);
    rows.push_back(k);
  }
  RowReport report = empty_report(static_cast<int>(rows.size()));
  report.neighbours = op.rows.neighbours(rows);
  report.reciprocal_condition = op.rows.reciprocal_condition(rows);
  std::ranges::fill(report.outcome, RowOutcome::Zero);
  throw_if_degenerate(scheme, cloud, {&points, static_cast<int>(points.size())}, report);
}

}  // namespace gradpsi
