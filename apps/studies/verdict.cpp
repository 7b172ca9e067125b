#include "studies/verdict.hpp"

#include <algorithm>
#include <complex>
#include <limits>

namespace gradpsi::apps {

namespace {

constexpr double suspect = 100;  // amplification

std::string sureness(const Findings& f) {
  if (f.spectrum)
    return f.spectrum->complete ? "by all eigenvalues" : "by the outermost eigenvalues";
  return f.growth.certain ? "certainly" : "by the look of the worst rows";
}

/// Of rows of points that evolve, by which they would not.
std::string still(std::int64_t zero) {
  return "not fit: " + count(zero, "row") + " of points that evolve could not be computed";
}

/// dt nu up to which explicit steps are stable, 0 if none are: without a spectrum by Gershgorin, for real
/// eigenvalues.
double explicit_step(const Findings& f, Stepper stepper) {
  constexpr double euler_end = 2,
                   rk4_end = 2.785293563405282;  // of the stable part of the real axis
  if (f.growth.grows || f.stepped.zero > 0) return 0;
  if (f.spectrum) return largest_stable_step(*f.spectrum, stepper);
  if (f.matrix.leftmost >= 0) return std::numeric_limits<double>::infinity();
  return (stepper == Stepper::Euler ? euler_end : rk4_end) / -f.matrix.leftmost;
}

/// dt nu below which backward Euler lets a field grow: |1 - dt nu lambda| < 1.
double growth_below(const Spectrum& s) {
  double step = 0;
  for (const std::complex<double>& lambda : s.values)
    if (lambda.real() > s.zero) step = std::max(step, 2 * lambda.real() / std::norm(lambda));
  return step;
}

std::string growing_implicit_steps(const Findings& f) {
  if (!f.spectrum)
    return "not fit: I - dt nu Psi turns singular near dt nu = " + text(1 / f.growth.rate) +
           ", and grows below";
  std::string result = "not fit: fields grow with dt nu below " + text(growth_below(*f.spectrum));
  const auto singular = singular_steps(*f.spectrum);
  if (singular.empty()) return result;
  result += "; I - dt nu Psi is singular at dt nu = " + text(singular.front());
  if (singular.size() > 1) result += " and " + count(std::ssize(singular) - 1, "larger one");
  return result;
}

Spread spread(const Eigen::VectorXd& values) {
  const Distribution d(values);
  return {d.quantile(0), d.quantile(0.5), d.quantile(1), d.largest_at};
}

}  // namespace

std::string on_derivatives(const Findings& f, const RowReport& rows) {
  const auto amplified = (f.rows.amplification.array() > suspect).count();
  const auto zero = std::ranges::count(rows.outcome, RowOutcome::Zero);
  const auto lowered = std::ranges::count(rows.outcome, RowOutcome::Lowered);
  if (zero == std::ssize(rows.outcome)) return "not fit: no row could be computed";
  if (amplified + zero + lowered == std::ssize(rows.outcome))
    return "not fit: all rows are amplified more than 100 times, of lower consistency or zero";
  std::string result = degree(f.scheme) < order(f.scheme.derivative)
                           ? "not fit: not exact on polynomials of degree " +
                                 text(static_cast<double>(order(f.scheme.derivative))) +
                                 ", its error does not vanish with the spacing"
                       : amplified + zero + lowered == 0 && rows.errors.size() > 0
                           ? "fit, every row to the tolerance"
                       : amplified + zero + lowered == 0 ? "fit, exact on polynomials of degree " +
                                                               std::to_string(degree(f.scheme))
                                                         : "fit but for";
  if (!result.ends_with("but for")) return result;
  if (amplified > 0) result += " " + count(amplified, "row") + " amplified more than 100 times,";
  if (zero > 0) result += " " + count(zero, "row") + " left zero,";
  if (lowered > 0) result += " " + count(lowered, "row") + " of lower consistency,";
  result.pop_back();
  return result;
}

std::string on_explicit_steps(const Problem& problem, const Findings& f) {
  if (f.stepped.zero > 0) return still(f.stepped.zero);
  if (f.growth.grows)
    return "not fit: fields grow, " + sureness(f) +
           (f.growth.point >= 0 ? ", fastest at " + at(problem, f.growth.point) : "") +
           ", at a rate of " + text(f.growth.rate * f.unit()) + " / dx^2";
  const auto step = [&](Stepper stepper) {
    const double size = explicit_step(f, stepper);
    return text(size) + " = " + text(size / f.unit()) + " dx^2";
  };
  return "fit up to dt nu = " + step(Stepper::Euler) + " with Euler, " +
         step(Stepper::RungeKutta4) + " with RK4 (" + sureness(f) + ")";
}

std::string on_implicit_steps(const Findings& f) {
  if (f.stepped.zero > 0) return still(f.stepped.zero);
  if (f.growth.grows) return growing_implicit_steps(f);
  const std::string solver = f.matrix.symmetric ? "Cholesky" : "LU or BiCGSTAB";
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
                    .error_bound = spread(f.error_bound),
                    .derivatives = on_derivatives(f, rows)};
  if (!f.laplacian()) return result;
  result.matrix = {std::ssize(f.stepped.evolving), f.matrix, f.stepped.walls};
  result.verdict = {f.growth, explicit_step(f, Stepper::Euler), on_explicit_steps(problem, f),
                    on_implicit_steps(f)};
  result.spectrum = f.spectrum;
  return result;
}

}  // namespace gradpsi::apps
