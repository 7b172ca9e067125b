#include "studies/orders.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <span>

#include "common/columns.hpp"
#include "common/fields.hpp"
#include "common/fit.hpp"
#include "studies/lattices.hpp"

namespace gradpsi::apps::orders {

namespace {

constexpr std::array degrees = {Degree{2, 2.5}, Degree{3, 3.5}, Degree{4, 4.5}, Degree{5, 5.5},
                                Degree{6, 5.5}};

std::string scheme_name(const Result& r) { return "laplacian-ls-" + std::to_string(r.of.degree); }

/// Completes a result that says which matrix it is of.
void measure(Result& r) {
  const Cloud cloud = irregular_points(2, r.points_per_side, 1);
  const double h = r.of.support_ratio / r.points_per_side;
  const Operator op = assemble(scheme_name(r), cloud, find_neighbours(cloud, h),
                               {.on_degenerate = OnDegenerate::Widen});
  const Exact field = exact(smooth_field, cloud.positions());
  const Eigen::ArrayXd error = (op.matrix() * field.u - field.laplacian).array();
  const Eigen::ArrayXd inside = ((cloud.positions().array() > h).rowwise().all() &&
                                 (cloud.positions().array() < 1 - h).rowwise().all())
                                    .cast<double>();
  r.points = cloud.size();
  r.neighbours = op.rows.neighbours.cast<double>().mean();
  r.error_l2 = std::sqrt(error.square().mean());
  r.interior_l2 = std::sqrt((inside * error.square()).sum() / inside.sum());
  r.worst_condition = 1 / op.rows.reciprocal_condition.minCoeff();
}

/// The results of one degree.
using Line = std::span<const Result>;

double interior_order(Line line) {
  const Result &coarse = line[line.size() - 2], &fine = line.back();
  return order_between(1.0 / coarse.points_per_side, coarse.interior_l2, 1.0 / fine.points_per_side,
                       fine.interior_l2);
}

double worst_condition(Line line) {
  return std::ranges::max(line, {}, &Result::worst_condition).worst_condition;
}

}  // namespace

std::vector<Result> results(bool quick) {
  std::vector<int> sides = {20, 40, 80};
  if (quick) sides.pop_back();
  std::vector<Result> all;
  for (const Degree& degree : degrees)
    for (const int side : sides) measure(all.emplace_back(Result{degree, side}));
  return all;
}

std::string csv(const std::vector<Result>& results) {
  return apps::csv({{"scheme", scheme_name},
                    {"support_ratio", [](auto& r) { return r.of.support_ratio; }},
                    {"points", &Result::points},
                    {"neighbours", &Result::neighbours},
                    {"error_l2", &Result::error_l2},
                    {"interior_l2", &Result::interior_l2},
                    {"worst_condition", &Result::worst_condition}},
                   results);
}

std::string table(const std::vector<Result>& results) {
  const std::size_t sides = results.size() / degrees.size();
  std::vector<Line> lines;
  for (std::size_t k = 0; k < results.size(); k += sides)
    lines.push_back(Line(results).subspan(k, sides));
  Columns<Line> columns = {
      {"P", [](Line l) { return l.back().of.degree; }, {.width = 2}},
      {"h/dx", [](Line l) { return l.back().of.support_ratio; }, {"%.1f", 6}},
      {"neighbours", [](Line l) { return l.back().neighbours; }, {"%.0f", 12}}};
  for (std::size_t k = 0; k < sides; ++k)
    columns.push_back({std::to_string(results[k].points_per_side) + "^2",
                       [k](Line l) { return l[k].error_l2; },
                       {"%.1e", 10}});
  columns.push_back({"interior order", interior_order, {"%.1f", 17}});
  columns.push_back({"worst condition", worst_condition, {"%.0e", 18}});
  return "laplacian-ls-P, jittered square (0.2 dx), L2 error over all points, boundary included:"
         "\n\n" +
         text_table(columns, lines);
}

}  // namespace gradpsi::apps::orders
