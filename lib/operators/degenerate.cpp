#include "operators/degenerate.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "base/names.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "operators/surface.hpp"

namespace gradpsi {

std::vector<Equations> ladder(const Scheme& scheme, int dimension, OnDegenerate policy) {
  std::vector<Equations> steps = {equations(scheme, dimension)};
  if (policy == OnDegenerate::Lower)
    while (const auto next = lowered(steps.back().scheme))
      steps.push_back(equations(*next, dimension));
  return steps;
}

RowReport empty_report(int rows) {
  return {IndexVector(rows), DenseVector(rows), DenseVector(rows), std::vector<RowOutcome>(rows),
          IndexVector(rows)};
}

void throw_if_degenerate(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
                         const Operator& op, const std::string& what) {
  const RowReport& report = op.rows;
  const int count = report.degenerate();
  if (count == 0) return;
  const auto first =
      std::ranges::find_if(report.outcome, [](auto o) { return o != RowOutcome::AsAsked; }) -
      report.outcome.begin();
  const int neighbours = report.neighbours[first];
  const double rcond = report.reciprocal_condition[first];
  const bool on_surface = op.normals.size() > 0;
  const int needed = on_surface ? std::max(unknowns(scheme, 2), surface_unknowns(degree(scheme)))
                                : unknowns(scheme, cloud.dimension());
  const std::string why =
      neighbours == 0 ? "it has no neighbour"
      : recipe(scheme).how == How::Passes
          ? "a row of " + std::string(recipe(scheme).after) + " that it is made of cannot be"
      : neighbours < needed ? "at least " + std::to_string(needed) + " neighbours are needed"
      : on_surface && op.normals.row(first).isZero() ? "its neighbours lie on no surface"
      : recipe(scheme).how == How::Programme         ? "none of its stencils is positive"
      : rcond > checked_below                        ? "its weights are not finite"
      : rcond >= singular_below ? "rounding makes its weights miss their conditions"
                                : "its moment system is singular";
  const int point = rows.point(static_cast<int>(first));
  throw StencilError(name(scheme) + " cannot be computed at " + what + ' ' +
                         std::to_string(cloud.number(point)) + ": " + why + " (" +
                         std::to_string(neighbours) + " neighbours, reciprocal condition number " +
                         shortest(rcond) + ", at " + coordinates(cloud.positions(), point) + "); " +
                         std::to_string(count) + " of " + std::to_string(rows.count) +
                         (count == 1 ? " rows is degenerate" : " rows are degenerate"),
                     point, neighbours, rcond);
}

std::string_view name(RowOutcome outcome) {
  return spelling(std::to_array<std::string_view>({"as-asked", "lowered", "widened", "zero"}),
                  outcome);
}

int RowReport::degenerate() const {
  return static_cast<int>(outcome.size() - std::ranges::count(outcome, RowOutcome::AsAsked));
}

}  // namespace gradpsi
