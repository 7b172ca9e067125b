#include "studies/failing.hpp"

#include <algorithm>
#include <gradpsi/gradpsi.hpp>
#include <span>

#include "common/columns.hpp"
#include "common/fields.hpp"
#include "studies/lattices.hpp"

namespace gradpsi::apps::failing {

namespace {

struct Case {
  int dimension, points_per_side;
  double support_ratio;
  Scheme scheme, cure;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {2, 80, 2.5, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"},
      {2, 40, 3.5, "laplacian-diffuse-soc", "laplacian-diffuse-soc-ls"},
      {3, 16, 3.0, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"},
      {3, 10, 2.5, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"}};
  return all;
}

/// Completes a result that says which matrix it is of.
void measure(Result& r) {
  constexpr int order = 5;  // of the derivatives that errors at second order are bounded by
  const Cloud cloud = irregular_points(r.dimension, r.points_per_side, r.seed);
  const Operator op =
      assemble(r.scheme, cloud, find_neighbours(cloud, r.support_ratio / r.points_per_side),
               {.on_degenerate = OnDegenerate::Widen});
  const RowDiagnosis rows = diagnose(r.scheme, cloud, op);
  const Exact field = exact(smooth_field, cloud.positions());
  const Eigen::VectorXd error = (op.matrix() * field.u - field.laplacian).cwiseAbs();
  const Eigen::VectorXd bound = error_bound(
      rows, derivative_bounds(smooth_field, cloud.positions(), op.rows.supports, order));
  Eigen::Index worst;
  r.points = cloud.size();
  r.error_max = error.maxCoeff(&worst);
  r.worst_condition = 1 / op.rows.reciprocal_condition.minCoeff();
  r.worst_amplification = rows.amplification.maxCoeff();
  r.bound_over_error = bound[worst] / error[worst];
  r.rows_above_bound = static_cast<int>((error.array() > bound.array()).count());
}

/// Results that differ by their seeds alone.
using Seeds = std::span<const Result>;

std::vector<Seeds> by_matrix(const std::vector<Result>& results) {
  std::vector<Seeds> all;
  for (auto begin = results.begin(); begin != results.end();) {
    const auto end = std::find_if(begin + 1, results.end(), [](auto& r) { return r.seed == 1; });
    all.emplace_back(begin, end);
    begin = end;
  }
  return all;
}

/// median (least .. most); of an even number the upper of the middle two
std::string spread(Seeds seeds, double Result::*value) {
  std::vector<double> values;
  for (const Result& r : seeds) values.push_back(r.*value);
  std::ranges::sort(values);
  const auto text = [](double x) { return cell(x, "%.2g"); };
  return text(values[values.size() / 2]) + " (" + text(values.front()) + " .. " +
         text(values.back()) + ")";
}

Column<Seeds> spread_column(const std::string& heading, double Result::*value, int width) {
  return {heading, [value](Seeds seeds) { return spread(seeds, value); }, {.width = width}};
}

std::string matrix_name(const Result& r) {
  const std::string dimension = std::to_string(r.dimension);
  return dimension + "D " + padded(std::to_string(r.points_per_side), 2) + "^" + dimension +
         ", h/dx " + cell(r.support_ratio, "%.1f") + "  " + name(r.scheme);
}

}  // namespace

std::vector<Result> results(int seeds) {
  std::vector<Result> all;
  for (const Case& c : cases())
    for (const Scheme& scheme : {c.scheme, c.cure})
      for (int seed = 1; seed <= seeds; ++seed)
        measure(all.emplace_back(
            Result{scheme, c.dimension, c.points_per_side, c.support_ratio, seed}));
  return all;
}

std::string csv(const std::vector<Result>& results) {
  return apps::csv({{"scheme", [](auto& r) { return name(r.scheme); }},
                    {"dimension", &Result::dimension},
                    {"points", &Result::points},
                    {"support_ratio", &Result::support_ratio},
                    {"jitter", [](auto&) { return irregular_jitter; }},
                    {"seed", &Result::seed},
                    {"error_max", &Result::error_max},
                    {"worst_condition", &Result::worst_condition},
                    {"worst_amplification", &Result::worst_amplification},
                    {"bound_over_error", &Result::bound_over_error},
                    {"rows_above_bound", &Result::rows_above_bound}},
                   results);
}

std::string table(const std::vector<Result>& results) {
  const auto seeds = by_matrix(results);
  // The headings from here on stand one to the right.
  const std::string error = padded("largest error", 29);
  return "Second-order Laplacians on jittered squares and cubes (0.2 dx), truncated at the "
         "boundary;\nmedians over " +
         std::to_string(seeds.front().size()) + " seeds (least .. most):\n\n" +
         text_table({{"", [](Seeds s) { return matrix_name(s.front()); }, {.width = -43}},
                     spread_column(error, &Result::error_max, 28),
                     spread_column("worst condition", &Result::worst_condition, 30),
                     spread_column("bound / error", &Result::bound_over_error, 22)},
                    seeds);
}

}  // namespace gradpsi::apps::failing
