#include "studies/verdict.hpp"

#include <algorithm>
#include <limits>

namespace gradpsi::apps {

namespace {

constexpr double suspect = 100;  // amplification

std::string sureness(const Forecast& forecast) {
  return forecast.certain ? "certainly" : "by the look of the worst rows";
}

/// Rows of points that evolve, by which they would not.
std::ptrdiff_t zero_among_evolving(const RowReport& rows, const Findings& f) {
  return std::ranges::count_if(f.evolving,
                               [&](int i) { return rows.outcome[i] == RowOutcome::Zero; });
}

std::string still(std::ptrdiff_t zero) {
  return "not fit: " + count(zero, "row") + " of points that evolve could not be computed";
}

/// dt nu up to which explicit Euler steps are stable, for real eigenvalues; 0 if none are.
double euler_step(const RowReport& rows, const Findings& f) {
  if (f.forecast.grows || zero_among_evolving(rows, f) > 0) return 0;
  return f.matrix.leftmost < 0 ? -2 / f.matrix.leftmost : std::numeric_limits<double>::infinity();
}

Spread spread(const Eigen::VectorXd& values) {
  const Distribution d(values);
  return {d.quantile(0), d.quantile(0.5), d.quantile(1), d.values.empty() ? -1 : d.largest_at};
}

}  // namespace

std::string on_derivatives(const Findings& f, const RowReport& rows) {
  const auto amplified = (f.rows.amplification.array() > suspect).count();
  const auto zero = std::ranges::count(rows.outcome, RowOutcome::Zero);
  const auto lowered = std::ranges::count(rows.outcome, RowOutcome::Lowered);
  if (zero == std::ssize(rows.outcome)) return "not fit: no row could be computed";
  if (amplified + zero + lowered == std::ssize(rows.outcome))
    return "not fit: all rows are amplified more than 100 times, of lower consistency or zero";
  std::string result =
      degree(f.scheme) < order(f.scheme.derivative)
          ? "not fit: an uncorrected scheme, its error does not vanish with the spacing"
      : amplified + zero + lowered == 0
          ? "fit, exact on polynomials of degree " + std::to_string(degree(f.scheme))
          : "fit but for";
  if (!result.ends_with("but for")) return result;
  if (amplified > 0) result += " " + count(amplified, "row") + " amplified more than 100 times,";
  if (zero > 0) result += " " + count(zero, "row") + " left zero,";
  if (lowered > 0) result += " " + count(lowered, "row") + " of lower consistency,";
  result.pop_back();
  return result;
}

std::string on_explicit_steps(const Problem& problem, const Findings& f) {
  if (const auto zero = zero_among_evolving(problem.op.rows, f)) return still(zero);
  if (f.forecast.grows)
    return "not fit: fields grow, " + sureness(f.forecast) + ", fastest at " +
           at(problem, f.forecast.point) + ", at a rate of " + text(f.forecast.rate * f.unit()) +
           " / dx^2";
  const double step = euler_step(problem.op.rows, f);
  return "fit up to dt nu = " + text(step) + " = " + text(step / f.unit()) +
         " dx^2 with Euler, 1.39 times that with RK4 (" + sureness(f.forecast) + ")";
}

std::string on_implicit_steps(const Problem& problem, const Findings& f) {
  if (const auto zero = zero_among_evolving(problem.op.rows, f)) return still(zero);
  const std::string solver = f.matrix.symmetric ? "Cholesky" : "LU or BiCGSTAB";
  if (f.forecast.grows)
    return "not fit: I - dt nu Psi turns singular near dt nu = " + text(1 / f.forecast.rate) +
           ", and grows below";
  return "fit with " + solver + ", any dt" +
         (f.matrix.m_matrix ? "; no new maxima with backward Euler" : "");
}

Inspection inspection(const Problem& problem, const Findings& f) {
  const RowReport& rows = problem.op.rows;
  Inspection result{.scheme = name(f.scheme),
                    .spacing = f.spacing,
                    .reciprocal_condition = spread(rows.reciprocal_condition),
                    .amplification = spread(f.rows.amplification),
                    .negative_share = spread(f.rows.negative_share),
                    .residual = spread(f.residual),
                    .error_bound = spread(f.error_bound()),
                    .derivatives = on_derivatives(f, rows)};
  if (!f.laplacian()) return result;
  result.matrix = {std::ssize(f.evolving), f.matrix};
  result.verdict = {f.forecast, euler_step(problem.op.rows, f), on_explicit_steps(problem, f),
                    on_implicit_steps(problem, f)};
  result.spectrum = f.spectrum;
  return result;
}

}  // namespace gradpsi::apps
