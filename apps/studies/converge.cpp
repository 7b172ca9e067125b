#include "studies/converge.hpp"

#include <algorithm>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <tuple>
#include <utility>

#include "common/columns.hpp"
#include "common/fields.hpp"
#include "common/fit.hpp"

namespace gradpsi::apps::converge {

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

bool same_curve(const Result& a, const Result& b) {
  return a.scheme == b.scheme && a.arrangement == b.arrangement &&
         a.support_ratio == b.support_ratio;
}

/// Root mean square and maximum over the points of [-half_width, half_width]^d.
std::pair<double, double> norms(const Eigen::VectorXd& error, const Positions& x,
                                double half_width) {
  double sum = 0, max = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (x.row(i).cwiseAbs().maxCoeff() > half_width) continue;
    sum += error[i] * error[i];
    max = std::max(max, error[i]);
    ++count;
  }
  return {std::sqrt(sum / count), max};
}

void set_norms(Result& result, const Eigen::VectorXd& error, const Positions& x) {
  std::tie(result.l2, result.max) = norms(error, x, 2);  // jitter can reach beyond 1
  const bool whole_supports = result.support_ratio * result.spacing < 0.5;
  std::tie(result.interior_l2, result.interior_max) =
      whole_supports ? norms(error, x, 0.5) : std::pair(not_a_number, not_a_number);
}

/// The results of all schemes on one cloud with one support.
void add_results(const Cloud& cloud, const Exact& derivatives, const Result& common, int threads,
                 std::vector<Result>& results) {
  const auto near = find_neighbours(cloud, common.support_ratio * cloud.spacing(), threads);
  for (const Scheme& scheme : classified_schemes()) {
    const Operator op =
        assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Lower, .threads = threads});
    Result& result = results.emplace_back(common);
    result.scheme = scheme;
    result.degenerate_rows = op.rows.degenerate();
    set_norms(result, errors(scheme.derivative, op, derivatives), cloud.positions());
  }
}

void sort_by_curve(std::vector<Result>& results) {
  const auto rank = [](const Scheme& s) {
    return std::ranges::find(classified_schemes(), s) - classified_schemes().begin();
  };
  std::ranges::stable_sort(results, {}, [&](const Result& r) {
    return std::tuple(rank(r.scheme), r.arrangement, r.support_ratio);
  });
}

void set_orders(std::vector<Result>& results) {
  for (std::size_t k = 1; k < results.size(); ++k) {
    const Result& coarse = results[k - 1];
    Result& fine = results[k];
    if (!same_curve(coarse, fine)) continue;
    fine.order = order_between(coarse.spacing, coarse.l2, fine.spacing, fine.l2);
    fine.interior_order =
        order_between(coarse.spacing, coarse.interior_l2, fine.spacing, fine.interior_l2);
  }
}

}  // namespace

std::vector<int> sides(int dimension, int points_max) {
  std::vector<int> result;
  for (int k = 0;; ++k) {
    // 1D: spacings 1, 1/2, 1/5 of each power of ten; else a factor of sqrt(2).
    static constexpr std::array<int, 3> decade = {2, 4, 10};
    const double side = dimension == 1 ? decade[k % 3] * std::pow(10, k / 3 + 1)
                                       : std::round(10 * std::exp2(0.5 * (k + 1)));
    if (std::pow(side, dimension) > points_max) return result;
    result.push_back(static_cast<int>(side));
  }
}

std::vector<Result> results(const Study& study, const ShowProgress& show) {
  const auto all_sides = sides(study.dimension, study.points_max);
  const int total = static_cast<int>(2 * support_ratios.size() * all_sides.size());
  int done = 0;
  std::vector<Result> results;
  for (const int side : all_sides)
    for (const Arrangement arrangement : {Arrangement::Regular, Arrangement::Irregular}) {
      const Cloud cloud = make_cloud(Lattice{.dimension = study.dimension,
                                             .points_per_side = side,
                                             .lower = -1,
                                             .upper = 1,
                                             .jitter = jitter(arrangement),
                                             .seed = seed});
      const Exact derivatives = exact(cosines(1, std::numbers::pi), cloud.positions());
      for (const double ratio : support_ratios) {
        add_results(cloud, derivatives,
                    {classified_schemes().front(), arrangement, ratio, cloud.size(), 2.0 / side, 0},
                    study.threads, results);
        show(++done, total);
      }
    }
  sort_by_curve(results);
  set_orders(results);
  return results;
}

std::string csv(const std::vector<Result>& results, int dimension) {
  Columns<Result> columns = {{"scheme", [](const Result& r) { return name(r.scheme); }},
                             {"arrangement", [](const Result& r) { return name(r.arrangement); }},
                             {"support_ratio", &Result::support_ratio},
                             {"points", &Result::points},
                             {"spacing", &Result::spacing},
                             {"error_l2", &Result::l2},
                             {"error_max", &Result::max},
                             {"order", &Result::order, {"%.4g"}}};
  if (dimension > 1)
    columns.insert(columns.end(), {{"interior_l2", &Result::interior_l2},
                                   {"interior_max", &Result::interior_max},
                                   {"interior_order", &Result::interior_order, {"%.4g"}}});
  return apps::csv(columns, results);
}

std::vector<Curve> curves(const std::vector<Result>& results) {
  std::vector<Curve> all;
  for (auto begin = results.begin(); begin != results.end();) {
    const auto end =
        std::find_if(begin, results.end(), [&](auto& r) { return !same_curve(r, *begin); });
    all.emplace_back(begin, end);
    begin = end;
  }
  return all;
}

Curve fitted_part(Curve curve) {
  const auto resolved = std::ranges::count_if(curve, [](auto& r) { return r.spacing > 0.99e-3; });
  const auto first =
      std::min<std::ptrdiff_t>(resolved / 2, std::max<std::ptrdiff_t>(resolved - 3, 0));
  return curve.subspan(first, resolved - first);
}

double fitted_order(Curve curve, Error error) {
  std::vector<double> spacings, errors;
  for (const Result& r : fitted_part(curve)) {
    spacings.push_back(r.spacing);
    errors.push_back(r.*error);
  }
  return log_slope(spacings, errors);
}

}  // namespace gradpsi::apps::converge
