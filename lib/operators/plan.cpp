#include "operators/plan.hpp"

#include <algorithm>
#include <optional>

#include "operators/row.hpp"

namespace gradpsi {
namespace {

/// The row's system as the vector code has it; nothing where it has none.
std::optional<BatchSystem> batch_system(const Equations& equations, int d) {
  const bool least_squares = equations.how == How::LeastSquares;
  const bool together = equations.how <= How::LeastSquares || equations.how == How::Normalized;
  if (!together || !equations.after.empty() || equations.unknowns == 0 ||
      (least_squares && equations.degree > highest_batched_degree(d)))
    return std::nullopt;
  BatchSystem system{};
  system.phi = equations.phi;
  system.how = equations.how;
  system.form = equations.form;
  system.degree = equations.degree;
  system.fitted = equations.fitted;
  system.diagonal = equations.diagonal;
  system.given_power = equations.given_power;
  system.limit = checked_below;
  if (least_squares)
    system.scaled_limit = equations.degree <= 2 ? refined_below : refined_twice_below;
  return system;
}

/// Whether one system answers both: one with conditions does, whatever is derived from it.
bool shared(const BatchSystem& a, const BatchSystem& b) {
  return a.how != How::Given && a.how == b.how && a.form == b.form && a.degree == b.degree &&
         a.phi == b.phi && a.fitted == b.fitted;
}

void add_outputs(const Equations& equations, Operator& op, BatchSystem& system) {
  for (Term term : equations.terms) {
    term.output += system.outputs;
    system.terms[system.term_count++] = term;
  }
  for (SparseMatrix& matrix : op.axes) {
    system.orders[system.outputs] = equations.order;
    system.values[system.outputs++] = matrix.valuePtr();
  }
  if (!system.reciprocal_condition)
    system.reciprocal_condition = op.rows.reciprocal_condition.data();
}

}  // namespace

Plan plan(const std::vector<Request>& requests, int dimension) {
  Plan result;
  auto& all = result.systems;
  for (const Request& request : requests) {
    const Equations& equations = request.steps.front();
    const auto system = batch_system(equations, dimension);
    result.of_request.push_back(-1);
    if (!system) continue;
    auto found = std::ranges::find_if(all, [&](const BatchSystem& other) {
      return shared(*system, other) && other.outputs + equations.outputs <= most_outputs;
    });
    if (found == all.end()) found = all.insert(all.end(), *system);
    add_outputs(equations, *request.op, *found);
    result.of_request.back() = static_cast<int>(found - all.begin());
  }
  return result;
}

}  // namespace gradpsi
