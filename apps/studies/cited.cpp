#include "studies/cited.hpp"

#include <algorithm>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <tuple>

#include "common/columns.hpp"
#include "common/fields.hpp"
#include "common/fit.hpp"
#include "studies/lattices.hpp"

namespace gradpsi::apps::cited {

namespace {

bool is_enough(double support_ratio_given, const Scheme& scheme) {
  return support_ratio_given >= support_ratio(scheme).value_or(0);
}

/// A cloud and what its field's derivatives are.
struct Field {
  Cloud cloud;
  Exact derivatives;

  Field(int dimension, int points_per_side)
      : cloud(irregular_points(dimension, points_per_side, seed)),
        derivatives(exact(cosines(1, std::numbers::pi), cloud.positions())) {}
};

struct Norms {
  double interior, boundary, worst;
};

/// Of the error at each point, apart for points deeper than rows reach; the mean over no points is NaN.
Norms norms(const Eigen::VectorXd& error, const Positions& x, double reach) {
  std::array<double, 2> squares = {0, 0};
  std::array<int, 2> counts = {0, 0};
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    const double depth = 0.5 - (x.row(i).array() - 0.5).abs().maxCoeff();
    const int side = depth > reach ? 0 : 1;
    squares[side] += error[i] * error[i];
    ++counts[side];
  }
  return {std::sqrt(squares[0] / counts[0]), std::sqrt(squares[1] / counts[1]), error.maxCoeff()};
}

struct Measured {
  Norms norms;
  int degenerate_rows;
};

/// All schemes on a cloud, as far as the support is enough for them, in their order.
std::vector<Measured> measure(const Field& field, double support_ratio, int threads) {
  const double support = support_ratio * field.cloud.spacing();
  const auto near = find_neighbours(field.cloud, support, threads);
  std::vector<Measured> all;
  for (const Scheme& scheme : schemes()) {
    if (!is_enough(support_ratio, scheme)) continue;
    const Operator op = assemble(scheme, field.cloud, near,
                                 {.on_degenerate = OnDegenerate::Lower, .threads = threads});
    all.push_back({norms(errors(scheme.derivative, op, field.derivatives), field.cloud.positions(),
                         reach(scheme) * support),
                   op.rows.degenerate()});
  }
  return all;
}

void sort_by_scheme(std::vector<Result>& results) {
  std::ranges::stable_sort(results, {}, [](const Result& r) {
    return std::ranges::find(schemes(), r.scheme) - schemes().begin();
  });
}

void set_places(std::vector<Result>& results) {
  std::vector<Result*> order;
  for (Result& r : results) order.push_back(&r);
  std::ranges::stable_sort(order, {}, [](const Result* r) {
    return std::tuple(r->scheme.derivative, r->support_ratio, std::isnan(r->interior), r->interior);
  });
  int place = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool first = k == 0 || order[k]->support_ratio != order[k - 1]->support_ratio ||
                       order[k]->scheme.derivative != order[k - 1]->scheme.derivative;
    order[k]->place = place = first ? 1 : place + 1;
  }
}

/// The results of one scheme.
using Line = std::vector<Result>;

Columns<Line> summary_columns() {
  constexpr int name_width = 28;
  Columns<Line> columns = {
      {"", [](const Line& line) { return name(line.front().scheme); }, {.width = -name_width}}};
  // The k-th support's result says; nothing where the scheme needs a larger one.
  const auto add = [&](std::size_t k, const char* heading, double Result::*number, Look look) {
    const double ratio = support_ratios[k];
    columns.push_back({heading,
                       [=](const Line& line) {
                         const auto r = std::ranges::find(line, ratio, &Result::support_ratio);
                         if (r == line.end()) return std::string();
                         const std::string text = cell((*r).*number, look.format);
                         return text.empty() ? "-" : text;
                       },
                       look});
  };
  for (std::size_t k = 0; k < support_ratios.size(); ++k) {
    add(k, "inside", &Result::interior, {"%.2g", 10});
    add(k, "order", &Result::interior_order, {"%.1f", 6});
    add(k, "at wall", &Result::boundary, {"%.2g", 9});
    add(k, "order", &Result::boundary_order, {"%.1f", 6});
    add(k, "worst", &Result::worst, {"%.2g", 9});
  }
  return columns;
}

std::vector<Line> lines(const std::vector<Result>& results, Derivative derivative) {
  std::vector<Line> lines;
  for (const Result& r : results) {
    if (r.scheme.derivative != derivative) continue;
    if (lines.empty() || !(lines.back().front().scheme == r.scheme)) lines.emplace_back();
    lines.back().push_back(r);
  }
  return lines;
}

}  // namespace

std::vector<Result> results(int dimension, int points_per_side, int threads,
                            const ShowProgress& show) {
  const Field coarse(dimension, points_per_side / 2), fine(dimension, points_per_side);
  std::vector<Result> results;
  int done = 0;
  for (const double ratio : support_ratios) {
    const auto before = measure(coarse, ratio, threads), after = measure(fine, ratio, threads);
    std::size_t k = 0;
    for (const Scheme& scheme : schemes()) {
      if (!is_enough(ratio, scheme)) continue;
      const Norms &was = before[k].norms, &is = after[k].norms;
      results.push_back({scheme, ratio, fine.cloud.size(), fine.cloud.spacing(),
                         after[k].degenerate_rows, is.interior, is.boundary, is.worst, was.interior,
                         was.boundary, order_between(2, was.interior, 1, is.interior),
                         order_between(2, was.boundary, 1, is.boundary)});
      ++k;
    }
    show(++done, static_cast<int>(support_ratios.size()));
  }
  sort_by_scheme(results);
  set_places(results);
  return results;
}

std::string csv(const std::vector<Result>& results) {
  return apps::csv({{"scheme", [](const Result& r) { return name(r.scheme); }},
                    {"support_ratio", &Result::support_ratio},
                    {"points", &Result::points},
                    {"spacing", &Result::spacing},
                    {"degenerate_rows", &Result::degenerate_rows},
                    {"interior", &Result::interior},
                    {"boundary", &Result::boundary},
                    {"worst", &Result::worst},
                    {"coarse_interior", &Result::coarse_interior},
                    {"coarse_boundary", &Result::coarse_boundary},
                    {"interior_order", &Result::interior_order, {"%.4g"}},
                    {"boundary_order", &Result::boundary_order, {"%.4g"}},
                    {"place", &Result::place}},
                   results);
}

std::string summary(const std::vector<Result>& results) {
  std::string text = "Error at spacing " + cell(results.front().spacing, "%.3g") + " over the " +
                     "points deeper than rows reach, over the others, and the worst; the orders "
                     "from twice the spacing.\n";
  for (const Derivative derivative :
       {Derivative::Gradient, Derivative::Laplacian, Derivative::Hessian, Derivative::Value}) {
    std::string heading = padded(std::string(name(derivative)), -28);
    for (const double ratio : support_ratios) heading += padded("h/dx " + cell(ratio, "%.1f"), 40);
    text += "\n" + heading + "\n" + text_table(summary_columns(), lines(results, derivative));
  }
  std::string lowered;
  for (const Result& r : results)
    if (r.degenerate_rows > 0)
      lowered += "  " + name(r.scheme) + ", h/dx " + cell(r.support_ratio, "%.1f") + ": " +
                 std::to_string(r.degenerate_rows) + '\n';
  if (!lowered.empty())
    text += "\nRows lowered to a consistency that could be solved, of " +
            std::to_string(results.front().points) + ":\n" + lowered;
  return text;
}

}  // namespace gradpsi::apps::cited
