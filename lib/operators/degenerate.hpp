#pragma once

#include <string>
#include <vector>

#include "gradpsi/assemble.hpp"
#include "operators/pattern.hpp"
#include "operators/row.hpp"

namespace gradpsi {

/// The equations to try for a row, best first: the scheme's, and by policy Lower those below it.
std::vector<Equations> ladder(const Scheme& scheme, int dimension, OnDegenerate policy);

RowReport empty_report(int rows);

/// Solves the gathered row by the first equations that can be, else leaves it zero, and reports it as row
/// k.
template <class AnyRow>
void solve_row(AnyRow& row, const std::vector<Equations>& steps, RowReport& report, int k) {
  report.outcome[k] = RowOutcome::Zero;
  report.degree[k] = -1;
  for (const Equations& step : steps) {
    const bool asked = &step == &steps.front();
    const Solution solution = row.solve(step);
    if (asked) report.reciprocal_condition[k] = solution.reciprocal_condition;
    if (!solution.solved) continue;
    report.outcome[k] = asked ? RowOutcome::AsAsked : RowOutcome::Lowered;
    report.degree[k] = step.exact;
    return;
  }
}

/// Throws StencilError for the first degenerate row, which is that of a `what`.
void throw_if_degenerate(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
                         const Operator& op, const std::string& what = "point");

}  // namespace gradpsi
