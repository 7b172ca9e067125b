#include "studies/findings.hpp"

#include <algorithm>
#include <cmath>
#include <gradpsi/system.hpp>
#include <limits>
#include <utility>

namespace gradpsi::apps {

namespace {

/// Residuals of the conditions that row i still promises, times dx^(q - k).
Eigen::VectorXd promised_residuals(const Scheme& scheme, const Operator& op,
                                   const RowDiagnosis& rows, int dimension) {
  const int q = order(scheme.derivative);
  Eigen::VectorXd worst = Eigen::VectorXd::Zero(rows.residuals.rows());
  for (Eigen::Index i = 0; i < worst.size(); ++i) {
    if (op.rows.degree[i] < 0) worst[i] = std::numeric_limits<double>::quiet_NaN();
    const double dx = std::pow(op.volumes[i], 1.0 / dimension);
    for (int k = 0; k <= op.rows.degree[i]; ++k)
      worst[i] = std::max(worst[i], rows.residuals(i, k) * std::pow(dx, q - k));
  }
  return worst;
}

/// Where the conditions hold, error_bound() for fields of which one derivative is known, that of the first
/// order at which the row may err.
Eigen::VectorXd bounds(const Scheme& scheme, const Operator& op, const RowDiagnosis& rows) {
  const int P = degree(scheme);
  Eigen::VectorXd bounds = rows.remainders.col(P + 1);
  for (Eigen::Index i = 0; i < bounds.size(); ++i)
    if (op.rows.degree[i] < std::max(P, order(scheme.derivative)))
      bounds[i] = std::numeric_limits<double>::quiet_NaN();
  return bounds;
}

/// What eigenvalues say of growth, and where a forecast has seen it.
Forecast growth(const Spectrum& spectrum, const Forecast& forecast) {
  Forecast result{.grows = spectrum.grows(), .certain = spectrum.complete};
  result.rate = spectrum.rightmost();
  if (result.grows && forecast.grows) result.point = forecast.point;
  return result;
}

/// n . grad u + transfer u at walls, a row for each.
SparseMatrix conditions_at(const WallConditions& walls, int n) {
  SparseMatrix result(std::ssize(walls.points), n);
  for (std::size_t a = 0; a < walls.gradient.size(); ++a)
    result += walls.normals.col(a).asDiagonal() * walls.gradient[a];
  if (walls.transfer.size() > 0)
    for (std::size_t k = 0; k < walls.points.size(); ++k)
      result.coeffRef(k, walls.points[k]) += walls.transfer[k];
  return result;
}

/// As the options that say supports in spacings have it; a single point's is that of its volume.
void set_spacing(const Cloud& cloud, const Operator& op, int threads, Findings& f) {
  if (cloud.size() == 0) return;
  f.spacings = cloud.size() > 1 || cloud.has_volumes()
                   ? local_spacing(cloud, threads)
                   : DenseVector::Constant(1, std::pow(op.volumes[0], 1.0 / cloud.dimension()));
  f.spacing = f.spacings.size() > 1 ? cloud.spacing(threads) : f.spacings[0];
}

}  // namespace

Stepped stepped(const Operator& laplacian, const BoundaryConditions& conditions) {
  const WallConditions& walls = conditions.walls;
  const int n = static_cast<int>(laplacian.matrix().rows());
  Stepped result{.matrix = eliminate(laplacian.matrix(), walls.points, conditions_at(walls, n))};
  std::vector<char> said(n, false);
  for (const auto* points : {&conditions.fixed.points, &walls.points})
    for (const int i : *points) said[i] = true;
  for (int i = 0; i < n; ++i) {
    if (said[i]) continue;
    result.evolving.push_back(i);
    result.zero += laplacian.rows.outcome[i] == RowOutcome::Zero;
  }
  return result;
}

Findings examine(const Scheme& scheme, const Problem& problem, Stepped stepped, bool spectrum,
                 int threads) {
  const Operator& op = problem.op;
  const int d = problem.cloud.dimension();
  Findings f(scheme, diagnose(scheme, problem.cloud, op, threads));
  f.residual = promised_residuals(f.scheme, op, f.rows, d);
  f.error_bound = bounds(f.scheme, op, f.rows);
  set_spacing(problem.cloud, op, threads, f);
  if (!f.laplacian()) return f;
  f.stepped = std::move(stepped);
  const std::vector<int>& evolving = f.stepped.evolving;
  const auto A = principal_part(f.stepped.matrix, evolving);
  const Eigen::VectorXd volumes = op.volumes(evolving);
  f.matrix = summarise(A, volumes);
  f.growth = forecast(problem.cloud, f.stepped.matrix, evolving, op.volumes);
  if (spectrum) {
    f.spectrum = gradpsi::spectrum(A, volumes, 2000, threads);
    f.growth = growth(*f.spectrum, f.growth);
  }
  return f;
}

Distribution::Distribution(const Eigen::VectorXd& of) {
  for (Eigen::Index i = 0; i < of.size(); ++i) {
    if (std::isnan(of[i])) continue;
    values.push_back(of[i]);
    if (largest_at < 0 || of[i] > of[largest_at]) largest_at = i;
    if (least_at < 0 || of[i] < of[least_at]) least_at = i;
  }
  std::ranges::sort(values);
}

double Distribution::quantile(double share) const {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

std::string at(const Problem& problem, Eigen::Index i) {
  std::string where = "point " + std::to_string(i) + " (";
  for (int a = 0; a < problem.cloud.dimension(); ++a)
    where += (a > 0 ? ", " : "") + text(problem.cloud.positions()(i, a));
  return where + ")";
}

void add_columns(Table& table, const RowReport& rows, const Findings& f) {
  Eigen::VectorXd outcome(rows.outcome.size());
  for (Eigen::Index i = 0; i < outcome.size(); ++i) outcome[i] = static_cast<int>(rows.outcome[i]);
  table.add("neighbours", rows.neighbours.cast<double>());
  table.add("support_used", rows.supports);
  table.add("reciprocal_condition", rows.reciprocal_condition);
  table.add("outcome", outcome);
  table.add("degree", rows.degree.cast<double>());
  table.add("amplification", f.rows.amplification);
  table.add("negative_share", f.rows.negative_share);
  table.add("residual", f.residual);
  table.add("error_bound", f.error_bound);
  if (rows.errors.size() > 0) table.add("certified_error", rows.errors);
}

}  // namespace gradpsi::apps
