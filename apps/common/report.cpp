#include "common/report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace gradpsi::apps {

namespace {

using Json = nlohmann::ordered_json;

/// An infinite number has no spelling in JSON.
Json finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

Json value(const NeighbourCounts& counts) {
  const bool whole = counts.median == std::floor(counts.median);
  const Json median = whole ? Json(static_cast<int>(counts.median)) : Json(counts.median);
  return {{"min", counts.min}, {"median", median}, {"max", counts.max}};
}

Json value(const Seconds& seconds) {
  return {{"read", seconds.read},
          {"search", seconds.search},
          {"weights", seconds.weights},
          {"write", seconds.write}};
}

Json value(const DegenerateRows& degenerate) {
  Json rows = Json::array();
  for (const DegenerateRow& row : degenerate.rows)
    rows.push_back({{"point", row.point},
                    {"outcome", name(row.outcome)},
                    {"degree", row.degree},
                    {"neighbours", row.neighbours},
                    {"support", row.support},
                    {"reciprocal_condition", row.reciprocal_condition}});
  return {{"lowered", degenerate.lowered},
          {"widened", degenerate.widened},
          {"zero", degenerate.zero},
          {"rows", std::move(rows)}};
}

Json value(const Spread& spread) {
  return {{"min", spread.min},
          {"median", spread.median},
          {"max", spread.max},
          {"point_of_max", spread.point_of_max}};
}

Json value(const WallRows& walls) {
  return {{"points", walls.count},
          {"second_order", walls.second_order},
          {"first_order", walls.first_order},
          {"by_gradient", walls.by_gradient}};
}

Json value(const Inspection::Matrix& matrix) {
  const MatrixSummary& m = matrix.summary;
  Json result = {{"points", matrix.points},
                 {"symmetric", m.symmetric},
                 {"dominant", m.dominant},
                 {"m_matrix", m.m_matrix},
                 {"bandwidth", m.bandwidth},
                 {"gershgorin_leftmost", m.leftmost},
                 {"gershgorin_rightmost", m.rightmost},
                 {"solver", m.symmetric ? "cholesky" : "lu"}};
  if (matrix.walls.count > 0) result["walls"] = value(matrix.walls);
  return result;
}

Json value(const Inspection::Verdict& verdict) {
  return {{"grows", verdict.growth.grows},
          {"certain", verdict.growth.certain},
          {"point", verdict.growth.point},
          {"rate", verdict.growth.rate},
          {"euler_step", finite(verdict.euler_step)},
          {"explicit_steps", verdict.explicit_steps},
          {"implicit_steps", verdict.implicit_steps}};
}

Json value(const Spectrum& spectrum) {
  return {{"complete", spectrum.complete},
          {"rightmost", spectrum.rightmost()},
          {"leftmost", spectrum.leftmost()},
          {"largest_imaginary", spectrum.widest()},
          {"grows", spectrum.grows()},
          {"euler_step", finite(largest_stable_step(spectrum, Stepper::Euler))},
          {"rk4_step", finite(largest_stable_step(spectrum, Stepper::RungeKutta4))},
          {"singular_steps", singular_steps(spectrum)}};
}

Json value(const Inspection& inspection) {
  Json result = {{"scheme", inspection.scheme},
                 {"spacing", inspection.spacing},
                 {"reciprocal_condition", value(inspection.reciprocal_condition)},
                 {"amplification", value(inspection.amplification)},
                 {"negative_share", value(inspection.negative_share)},
                 {"residual", value(inspection.residual)},
                 {"error_bound", value(inspection.error_bound)},
                 {"derivatives", inspection.derivatives}};
  if (inspection.matrix) result["matrix"] = value(*inspection.matrix);
  if (inspection.verdict) result["verdict"] = value(*inspection.verdict);
  if (inspection.spectrum) result["spectrum"] = value(*inspection.spectrum);
  return result;
}

Json value(const SolverReport& solver) {
  return {{"method", name(solver.method)},
          {"description", solver.description},
          {"reason", solver.reason},
          {"unknowns", solver.unknowns},
          {"factor_entries", solver.factor.entries},
          {"factor_flops", solver.factor.flops},
          {"factor_bytes", solver.factor.bytes},
          {"analyse_seconds", solver.factor.analyse_seconds},
          {"factor_seconds", solver.factor.factor_seconds},
          {"setup_seconds", solver.setup_seconds}};
}

Json value(const Steps& steps) {
  return {{"count", steps.count},
          {"largest_residual", steps.total.residual},
          {"iterations", steps.total.iterations},
          {"seconds", steps.total.seconds},
          {"convergence", steps.convergence}};
}

}  // namespace

std::string json(const Report& report) {
  Json result = {{"points", report.points},
                 {"entries", report.entries},
                 {"neighbours", value(report.neighbours)},
                 {"seconds", value(report.seconds)},
                 {"degenerate_rows", report.degenerate_rows},
                 {"dropped_points", report.dropped_points},
                 {"peak_bytes", report.peak_bytes},
                 {"threads", report.threads}};
  if (report.processes) result["processes"] = *report.processes;
  if (report.probes) result["probes"] = *report.probes;
  if (!report.warnings.empty()) result["warnings"] = report.warnings;
  if (report.largest_error) {
    result["schemes"] = report.schemes;
    result["tolerance"] = report.tolerance;
    result["wavelength"] = report.wavelength;
    result["largest_error"] = finite(*report.largest_error);
  }
  if (report.degenerate.count() > 0) result["degenerate"] = value(report.degenerate);
  if (report.inspection) result["inspection"] = value(*report.inspection);
  if (report.solver) result["solver"] = value(*report.solver);
  if (report.steps) result["steps"] = value(*report.steps);
  return result.dump(2) + "\n";
}

std::string json(std::span<const Scheme> schemes) {
  Json list = Json::array();
  for (const Scheme& scheme : schemes)
    list.push_back({{"name", name(scheme)},
                    {"derivative", name(scheme.derivative)},
                    {"weight", name(scheme.weight)},
                    {"consistency", consistency_name(scheme)},
                    {"formula", formula(scheme)},
                    {"conditions", conditions(scheme)},
                    {"volume_scaled_symmetry", name(symmetry(scheme))}});
  return list.dump(2) + "\n";
}

std::string json(std::span<const CitedSystem> systems) {
  Json list = Json::array();
  for (const CitedSystem& system : systems)
    list.push_back({{"reference", system.reference},
                    {"name", system.name},
                    {"system", system.who},
                    {"formula", formula(system.name)},
                    {"conditions", conditions(system.name)},
                    {"equal_to", system.equal_to.empty() ? Json() : Json(system.equal_to)}});
  return list.dump(2) + "\n";
}

}  // namespace gradpsi::apps
