#include "studies/findings_text.hpp"

#include <iostream>

#include "common/outputs.hpp"
#include "studies/verdict.hpp"

namespace gradpsi::apps {

namespace {

std::string yes_no(bool b) { return b ? "yes" : "no"; }

template <class... Parts>
void line(const std::string& label, const Parts&... parts) {
  std::cout << "  " << label << std::string(22 - std::min<std::size_t>(21, label.size()), ' ');
  (std::cout << ... << parts) << '\n';
}

/// Of rows that are chosen to a tolerance.
void print_errors(const Problem& problem) {
  const Distribution errors(problem.op.rows.errors);
  line("error at most", text(errors.quantile(0.5)), " (median), ", text(errors.quantile(1)),
       " (worst, ", at(problem, errors.largest_at),
       ") of the waves asked for, over (2 pi / length)^order");
}

void print_bound(const Problem& problem, const Findings& f) {
  if (problem.op.rows.errors.size() > 0) return print_errors(problem);
  const Distribution bound(f.error_bound);
  const auto without = f.error_bound.size() - std::ssize(bound.values);
  if (bound.values.empty()) return line("error at most", "no row has a bound");
  line("error at most", text(bound.quantile(0.5)), " (median), ", text(bound.quantile(1)),
       " (worst, ", at(problem, bound.largest_at), ")");
  line("", "times the largest derivative of u of order ", degree(f.scheme) + 1,
       without > 0 ? "; " + count(without, "row") + " without a bound" : "");
}

void print_rows(const Problem& problem, const Findings& f, const Report& report) {
  const auto& rows = problem.op.rows;
  const bool chosen = rows.errors.size() > 0;
  std::cout << (chosen ? std::string(name(f.scheme.derivative)) + " to a tolerance"
                       : name(f.scheme))
            << ": " << count(problem.cloud.size(), "point") << " in " << problem.cloud.dimension()
            << "D";
  if (problem.cloud.size() > 0) std::cout << ", spacing " << spacing_text(f.spacings);
  std::cout << '\n';
  if (problem.cloud.size() == 0) return;
  std::cout << "rows\n";
  if (chosen) line("schemes", words(report.schemes));
  const auto& neighbours = report.neighbours;
  const Eigen::VectorXd in_spacings = f.spacings.size() > 1
                                          ? Eigen::VectorXd(rows.supports.cwiseQuotient(f.spacings))
                                          : Eigen::VectorXd(rows.supports / f.spacing);
  line("neighbours", neighbours.min, " to ", neighbours.max, ", median ", text(neighbours.median),
       "; supports ", text(in_spacings.minCoeff()), " to ", text(in_spacings.maxCoeff()),
       " spacings");
  if (rows.degenerate() > 0) {
    const auto& bad = report.degenerate;
    line("degenerate", rows.degenerate(), ": ", bad.lowered, " lowered, ", bad.widened,
         " widened, ", bad.zero, " zero; the first is ", at(problem, bad.rows.front().point));
  }
  const Distribution condition(rows.reciprocal_condition), amplification(f.rows.amplification);
  if (degree(f.scheme) > 0)
    line("reciprocal condition", "least ", text(condition.quantile(0)), " at ",
         at(problem, condition.least_at), ", median ", text(condition.quantile(0.5)));
  line("amplification", "median ", text(amplification.quantile(0.5)), ", 99 % up to ",
       text(amplification.quantile(0.99)), ", largest ", text(amplification.quantile(1)), " at ",
       at(problem, amplification.largest_at));
  if (f.laplacian()) line("negative weights", text(100 * f.rows.negative_share.mean()), " %");
  const Distribution residual(f.residual);
  line("conditions met",
       degree(f.scheme) < 0      ? ""
       : residual.values.empty() ? "by no row "
                                 : "to " + text(residual.quantile(1)) + " at worst ",
       "(", chosen ? "those of each row's own scheme" : conditions(f.scheme), ")");
  if (degree(f.scheme) >= order(f.scheme.derivative)) {
    print_bound(problem, f);
  } else {
    const Distribution off(f.rows.residuals.col(order(f.scheme.derivative)));
    line("not promised", f.laplacian() ? "sum psi r r = 2 I [10]" : "sum G r = I [4]", ": off by ",
         text(off.quantile(0.5)), " (median), ", text(off.quantile(1)), " (worst)");
  }
}

void print_matrix(const Findings& f) {
  const auto& m = f.matrix;
  std::cout << "matrix of the " << count(f.stepped.evolving.size(), "point") << " that evolve\n";
  if (const WallRows& w = f.stepped.walls; w.count > 0)
    line("walls", w.count, ": ", w.second_order, " rows of second order, ", w.first_order,
         " of first, ", w.by_gradient, " by a gradient's rows");
  line("symmetric by volumes", yes_no(m.symmetric), "; diagonally dominant: ", yes_no(m.dominant),
       "; minus it an M-matrix: ", yes_no(m.m_matrix), "; bandwidth ", m.bandwidth);
  line("eigenvalues", "real parts in [", text(m.leftmost * f.unit()), ", ",
       text(m.rightmost * f.unit()), "] / dx^2, by Gershgorin");
  if (!f.spectrum) return;
  const Spectrum& s = *f.spectrum;
  line("computed", s.complete ? "all" : "the outermost", ": real parts in [",
       text(s.leftmost() * f.unit()), ", ", text(s.rightmost() * f.unit()),
       "] / dx^2, imaginary parts up to ", text(s.widest() * f.unit()), " / dx^2");
}

}  // namespace

void print(const Problem& problem, const Findings& f, const Report& report) {
  print_rows(problem, f, report);
  if (problem.cloud.size() == 0) return;
  if (f.laplacian()) print_matrix(f);
  std::cout << "verdict\n";
  line("derivatives", on_derivatives(f, problem.op.rows));
  if (!f.laplacian()) return;
  line("explicit steps", on_explicit_steps(problem, f));
  line("implicit steps", on_implicit_steps(f));
}

}  // namespace gradpsi::apps
