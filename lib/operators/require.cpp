#include <algorithm>

#include "operators/degenerate.hpp"

namespace gradpsi {

void require(const Scheme& scheme, const Cloud& cloud, const Operator& op,
             std::vector<int> except) {
  std::ranges::sort(except);
  std::vector<int> points, rows;  // of the degenerate rows
  for (int k = 0; k < static_cast<int>(op.rows.outcome.size()); ++k) {
    const int point = op.point(k);
    if (op.rows.outcome[k] == RowOutcome::AsAsked || std::ranges::binary_search(except, point))
      continue;
    points.push_back(point);
    rows.push_back(k);
  }
  Operator those;
  those.rows = empty_report(static_cast<int>(rows.size()));
  those.rows.neighbours = op.rows.neighbours(rows);
  those.rows.reciprocal_condition = op.rows.reciprocal_condition(rows);
  std::ranges::fill(those.rows.outcome, RowOutcome::Zero);
  if (op.normals.size() > 0) those.normals = op.normals(rows, Eigen::all);
  throw_if_degenerate(scheme, cloud, {&points, static_cast<int>(points.size())}, those);
}

}  // namespace gradpsi
