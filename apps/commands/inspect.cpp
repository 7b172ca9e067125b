// gradpsi inspect: what an operator on the points of a file is fit for, and which rows spoil it.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "common/operator_options.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::Derivative;
using gradpsi::RowOutcome;
using gradpsi::Scheme;
using std::filesystem::path;
using Json = nlohmann::ordered_json;

constexpr double suspect = 100;  // amplification

struct InspectOptions : OperatorOptions {
  std::string fixed;
  bool spectrum = false;
  path output;
};

/// Everything that is known about the operator.
struct Findings {
  Findings(const Scheme& scheme, gradpsi::RowDiagnosis rows)
      : scheme(scheme), rows(std::move(rows)) {}

  Scheme scheme;
  gradpsi::RowDiagnosis rows;
  Eigen::VectorXd residual;   // per row, the largest of a promised condition, free of scale
  std::vector<int> evolving;  // points that are not fixed
  double spacing = 0;         // (mean volume)^(1/d)
  // Of a Laplacian's evolving rows and columns:
  gradpsi::MatrixSummary matrix;
  gradpsi::Forecast forecast;
  std::optional<gradpsi::Spectrum> spectrum;

  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
  double unit() const { return spacing * spacing; }
};

/// Residuals of the conditions that row i still promises, times dx^(q - k).
Eigen::VectorXd promised_residuals(const Scheme& scheme, const gradpsi::Operator& op,
                                   const gradpsi::RowDiagnosis& rows, int dimension) {
  const int q = scheme.derivative == Derivative::Gradient ? 1 : 2;
  Eigen::VectorXd worst = Eigen::VectorXd::Zero(rows.residuals.rows());
  for (Eigen::Index i = 0; i < worst.size(); ++i) {
    const double dx = std::pow(op.volumes[i], 1.0 / dimension);
    for (int k = 0; k <= op.rows.degree[i]; ++k)
      worst[i] = std::max(worst[i], rows.residuals(i, k) * std::pow(dx, q - k));
  }
  return worst;
}

Findings examine(const InspectOptions& options, const Problem& problem) {
  const gradpsi::Operator& op = problem.op;
  const int n = problem.cloud.size(), d = problem.cloud.dimension();
  Findings f(options.scheme, gradpsi::diagnose(options.scheme, problem.cloud, op, options.threads));
  f.residual = promised_residuals(f.scheme, op, f.rows, d);
  if (n > 0) f.spacing = std::pow(op.volumes.mean(), 1.0 / d);
  const Eigen::VectorXd fixed = options.fixed.empty()
                                    ? Eigen::VectorXd(Eigen::VectorXd::Zero(n))
                                    : finite_column(problem.table, problem.cloud, options.fixed);
  for (int i = 0; i < n; ++i)
    if (fixed[i] == 0) f.evolving.push_back(i);
  if (!f.laplacian()) return f;
  const auto A = gradpsi::principal_part(op.matrix(), f.evolving);
  const Eigen::VectorXd volumes = op.volumes(f.evolving);
  f.matrix = gradpsi::summarise(A, volumes);
  f.forecast = forecast(problem.cloud, op.matrix(), f.evolving, op.volumes);
  if (options.spectrum) f.spectrum = gradpsi::spectrum(A, volumes, 2000, options.threads);
  return f;
}

/// A quantity of the rows, sorted.
struct Distribution {
  explicit Distribution(const Eigen::VectorXd& values) : values(values.begin(), values.end()) {
    if (values.size() > 0) values.maxCoeff(&largest_at);
    if (values.size() > 0) values.minCoeff(&least_at);
    std::ranges::sort(this->values);
  }
  double quantile(double share) const {
    if (values.empty()) return 0;
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
  std::vector<double> values;
  Eigen::Index largest_at = 0, least_at = 0;
};

std::string count(Eigen::Index n, const std::string& what) {
  return std::to_string(n) + ' ' + what + (n == 1 ? "" : "s");
}

std::string yes_no(bool b) { return b ? "yes" : "no"; }

template <class... Parts>
void line(const std::string& label, const Parts&... parts) {
  std::cout << "  " << label << std::string(22 - std::min<std::size_t>(21, label.size()), ' ');
  (std::cout << ... << parts) << '\n';
}

std::string at(const Problem& problem, Eigen::Index i) {
  std::string where = "point " + std::to_string(i) + " (";
  for (int a = 0; a < problem.cloud.dimension(); ++a)
    where += (a > 0 ? ", " : "") + text(problem.cloud.positions()(i, a));
  return where + ")";
}

void print_rows(const InspectOptions& options, const Problem& problem, const Findings& f) {
  const auto& rows = problem.op.rows;
  std::cout << options.scheme << ": " << count(problem.cloud.size(), "point") << " in "
            << problem.cloud.dimension() << "D, spacing " << text(f.spacing) << '\n';
  if (problem.cloud.size() == 0) return;
  std::cout << "rows\n";
  const auto& neighbours = problem.report["neighbours"];
  line("neighbours", neighbours["min"], " to ", neighbours["max"], ", median ",
       neighbours["median"], "; supports ", text(rows.supports.minCoeff() / f.spacing), " to ",
       text(rows.supports.maxCoeff() / f.spacing), " spacings");
  if (rows.degenerate() > 0) {
    const auto& bad = problem.report["degenerate"];
    line("degenerate", rows.degenerate(), ": ", bad["lowered"], " lowered, ", bad["widened"],
         " widened, ", bad["zero"], " zero; the first is ", at(problem, bad["rows"][0]["point"]));
  }
  const Distribution condition(rows.reciprocal_condition), amplification(f.rows.amplification);
  if (f.scheme.consistency != gradpsi::Consistency::Zoc)
    line("reciprocal condition", "least ", text(condition.quantile(0)), " at ",
         at(problem, condition.least_at), ", median ", text(condition.quantile(0.5)));
  line("amplification", "median ", text(amplification.quantile(0.5)), ", 99 % up to ",
       text(amplification.quantile(0.99)), ", largest ", text(amplification.quantile(1)), " at ",
       at(problem, amplification.largest_at));
  if (f.laplacian()) line("negative weights", text(100 * f.rows.negative_share.mean()), " %");
  const Distribution residual(f.residual);
  line("conditions met to", text(residual.quantile(1)), " at worst (", conditions(f.scheme), ")");
  if (const int P = degree(f.scheme); P >= (f.laplacian() ? 2 : 1)) {
    const Distribution bound(f.rows.remainders.col(P + 1));
    line("error at most", text(bound.quantile(0.5)), " (median), ", text(bound.quantile(1)),
         " (worst, ", at(problem, bound.largest_at), ")");
    line("", "times the largest derivative of u of order ", P + 1);
  } else {
    const Distribution off(f.rows.residuals.col(f.laplacian() ? 2 : 1));
    line("not promised", f.laplacian() ? "sum psi r r = 2 I [10]" : "sum G r = I [4]", ": off by ",
         text(off.quantile(0.5)), " (median), ", text(off.quantile(1)), " (worst)");
  }
}

void print_matrix(const Findings& f) {
  const auto& m = f.matrix;
  const auto steps = [&](double size) {
    return text(size) + " = " + text(size / f.unit()) + " dx^2";
  };
  std::cout << "matrix of the " << count(f.evolving.size(), "point") << " that evolve\n";
  line("symmetric by volumes", yes_no(m.symmetric), "; diagonally dominant: ", yes_no(m.dominant),
       "; minus it an M-matrix: ", yes_no(m.m_matrix), "; bandwidth ", m.bandwidth);
  line("eigenvalues", "real parts in [", text(m.leftmost * f.unit()), ", ",
       text(m.rightmost * f.unit()), "] / dx^2, by Gershgorin");
  if (!f.spectrum) return;
  const gradpsi::Spectrum& s = *f.spectrum;
  line("computed", s.complete ? "all" : "the outermost", ": real parts in [",
       text(s.leftmost() * f.unit()), ", ", text(s.rightmost() * f.unit()),
       "] / dx^2, imaginary parts up to ", text(s.widest() * f.unit()), " / dx^2");
  const double euler = largest_stable_step(s, gradpsi::Stepper::Euler),
               rk4 = largest_stable_step(s, gradpsi::Stepper::RungeKutta4);
  line("", "explicit steps: ",
       euler == 0 ? std::string("neither Euler nor RK4 is stable, whatever the step")
                  : "dt nu up to " + steps(euler) + " with Euler, " + steps(rk4) + " with RK4");
  const auto singular = singular_steps(s);
  if (singular.empty())
    line("", "implicit steps: I - dt nu Psi is regular at any dt");
  else
    line("", "implicit steps: I - dt nu Psi is singular at dt nu = ", steps(singular.front()),
         singular.size() > 1 ? " and " + count(std::ssize(singular) - 1, "larger one") : "");
}

/// What the rows say of derivatives.
std::string on_derivatives(const Findings& f, const gradpsi::RowReport& rows) {
  const auto amplified = (f.rows.amplification.array() > suspect).count();
  const auto zero = std::ranges::count(rows.outcome, RowOutcome::Zero);
  const auto lowered = std::ranges::count(rows.outcome, RowOutcome::Lowered);
  std::string result =
      degree(f.scheme) < (f.laplacian() ? 2 : 1)
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

std::string sureness(const gradpsi::Forecast& forecast) {
  return forecast.certain ? "certainly" : "by the look of the worst rows";
}

/// dt nu up to which explicit Euler steps are stable, for real eigenvalues; 0 if none are.
double euler_step(const Findings& f) {
  if (f.forecast.grows) return 0;
  return f.matrix.leftmost < 0 ? -2 / f.matrix.leftmost : std::numeric_limits<double>::infinity();
}

std::string on_explicit_steps(const Problem& problem, const Findings& f) {
  if (f.forecast.grows)
    return "not fit: fields grow, " + sureness(f.forecast) + ", fastest at " +
           at(problem, f.forecast.point) + ", at a rate of " + text(f.forecast.rate * f.unit()) +
           " / dx^2";
  const double step = euler_step(f);
  return "fit up to dt nu = " + text(step) + " = " + text(step / f.unit()) +
         " dx^2 with Euler, 1.39 times that with RK4 (" + sureness(f.forecast) + ")";
}

std::string on_implicit_steps(const Findings& f) {
  const std::string solver = f.matrix.symmetric ? "Cholesky" : "LU or BiCGSTAB";
  if (f.forecast.grows)
    return "not fit: I - dt nu Psi turns singular near dt nu = " + text(1 / f.forecast.rate) +
           ", and grows below";
  return "fit with " + solver + ", any dt" +
         (f.matrix.m_matrix ? "; no new maxima with backward Euler" : "");
}

Json json(const Distribution& d) {
  return {{"min", d.quantile(0)},
          {"median", d.quantile(0.5)},
          {"max", d.quantile(1)},
          {"point_of_max", d.values.empty() ? -1 : d.largest_at}};
}

/// An infinite number has no spelling in JSON.
Json finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

Json json(const Problem& problem, const Findings& f) {
  const auto& rows = problem.op.rows;
  Json result = {
      {"scheme", name(f.scheme)},
      {"spacing", f.spacing},
      {"reciprocal_condition", json(Distribution(rows.reciprocal_condition))},
      {"amplification", json(Distribution(f.rows.amplification))},
      {"negative_share", json(Distribution(f.rows.negative_share))},
      {"residual", json(Distribution(f.residual))},
      {"error_bound", json(Distribution(f.rows.remainders.col(f.rows.remainders.cols() - 3)))},
      {"derivatives", on_derivatives(f, rows)}};
  if (!f.laplacian()) return result;
  const auto& m = f.matrix;
  result["matrix"] = {{"points", f.evolving.size()},
                      {"symmetric", m.symmetric},
                      {"dominant", m.dominant},
                      {"m_matrix", m.m_matrix},
                      {"bandwidth", m.bandwidth},
                      {"gershgorin_leftmost", m.leftmost},
                      {"gershgorin_rightmost", m.rightmost},
                      {"solver", m.symmetric ? "cholesky" : "lu"}};
  result["verdict"] = {{"grows", f.forecast.grows},
                       {"certain", f.forecast.certain},
                       {"point", f.forecast.point},
                       {"rate", f.forecast.rate},
                       {"euler_step", finite(euler_step(f))},
                       {"explicit_steps", on_explicit_steps(problem, f)},
                       {"implicit_steps", on_implicit_steps(f)}};
  if (!f.spectrum) return result;
  using gradpsi::Stepper;
  result["spectrum"] = {
      {"complete", f.spectrum->complete},
      {"rightmost", f.spectrum->rightmost()},
      {"leftmost", f.spectrum->leftmost()},
      {"largest_imaginary", f.spectrum->widest()},
      {"grows", f.spectrum->grows()},
      {"euler_step", finite(largest_stable_step(*f.spectrum, Stepper::Euler))},
      {"rk4_step", finite(largest_stable_step(*f.spectrum, Stepper::RungeKutta4))},
      {"singular_steps", singular_steps(*f.spectrum)}};
  return result;
}

void add_columns(gradpsi::Table& table, const gradpsi::RowReport& rows, const Findings& f) {
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
  table.add("error_bound", f.rows.remainders.col(f.rows.remainders.cols() - 3));
}

void run(const InspectOptions& options) {
  std::vector<path> files;
  if (!options.output.empty()) files.push_back(options.output);
  check_outputs(options, files);
  Problem problem = read_points(options);
  assemble(options, problem);
  const Findings findings = examine(options, problem);
  problem.report["inspection"] = json(problem, findings);
  if (!options.output.empty()) {
    add_columns(problem.table, problem.op.rows, findings);
    write_table(options.output, problem.table);
  }
  write_report(options, problem);

  print_rows(options, problem, findings);
  if (problem.cloud.size() == 0) return;
  if (findings.laplacian()) print_matrix(findings);
  std::cout << "verdict\n";
  line("derivatives", on_derivatives(findings, problem.op.rows));
  if (findings.laplacian()) {
    line("explicit steps", on_explicit_steps(problem, findings));
    line("implicit steps", on_implicit_steps(findings));
  }
  if (!options.output.empty()) std::cout << "every row: " << options.output.string() << '\n';
}

}  // namespace

std::function<void()> declare_inspect(Options& options) {
  auto wanted = std::make_shared<InspectOptions>();
  wanted->declare(options);
  options
      .text("--fixed", wanted->fixed, "COLUMN",
            "Points where this column is not 0 keep their value: steps are judged by the\n"
            "others. Without it the points just end, which no scheme of second order survives")
      .check(not_empty);
  options.flag("--spectrum", wanted->spectrum,
               "Compute the eigenvalues too: all of them up to 2,000 points (half a minute),\n"
               "beyond the outermost ones");
  declare_table_output(
      options, wanted->output,
      "OUT.csv or OUT.vtu: the input's columns and what is known of each row:\n"
      "neighbours, support_used, reciprocal_condition, outcome (0 as asked, 1 lowered,\n"
      "2 widened, 3 zero), degree, amplification, negative_share, residual,\n"
      "error_bound");
  options.examples(
      "Example: gradpsi inspect points.csv --scheme laplacian-mixed-soc --support-ratio 3 "
      "-o rows.vtu");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
