#include "studies/foretold.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numeric>
#include <optional>

#include "common/chunks.hpp"
#include "common/columns.hpp"

namespace gradpsi::apps::foretold {

namespace {

using stability::Walls;

std::vector<Case> cases(const stability::Study& study) {
  const int d = study.dimension, seeds = study.quick || d == 3 ? 1 : 3;
  std::vector<Case> all;
  for (const scattered::Kind& kind : scattered::kinds()) {
    if (d < kind.least_dimension || d > kind.most_dimension) continue;
    for (const Scheme& scheme : schemes()) {
      if (scheme.derivative != Derivative::Laplacian || (d == 3 && degree(scheme) > 4)) continue;
      const double shortest = std::max(2.5, support_ratio(scheme).value_or(0));
      for (const double ratio : {shortest, shortest + 1})
        for (const Walls walls : {Walls::Periodic, Walls::Dirichlet, Walls::Truncated})
          for (int seed = 1; seed <= seeds; ++seed)
            if (walls != Walls::Periodic || kind.can_be_periodic())
              all.push_back({&kind, scheme, ratio, walls, seed});
    }
  }
  return all;
}

int points_per_side(const stability::Study& study) {
  static constexpr std::array full = {300, 20, 8}, quick = {40, 14, 7};
  return (study.quick ? quick : full)[study.dimension - 1];
}

/// A matrix, and whose rows and columns count.
struct System {
  Cloud cloud;
  Operator op;
  std::vector<int> evolving;
};

DenseVector supports(const Case& c, const scattered::Scene& scene) {
  const DenseVector spacings = local_spacing(scene.cloud, 1);
  DenseVector supports = c.support_ratio * scene.stretch;
  if (spacings.size() == 1)
    supports *= spacings[0];
  else
    supports.array() *= spacings.array();
  for (const double side : scene.cloud.box())
    if (side > 0) supports = supports.cwiseMin(0.499 * side);
  return supports;
}

System system(const Case& c, const stability::Study& study) {
  auto scene = scattered::scene(*c.kind, study.dimension, points_per_side(study), c.seed,
                                c.walls == Walls::Periodic);
  Operator op = assemble(c.scheme, scene.cloud, find_neighbours(scene.cloud, supports(c, scene), 1),
                         {.on_degenerate = OnDegenerate::Widen, .threads = 1});
  if (c.walls == Walls::Truncated) {
    scene.inner.resize(scene.cloud.size());
    std::iota(scene.inner.begin(), scene.inner.end(), 0);
  }
  return {std::move(scene.cloud), std::move(op), std::move(scene.inner)};
}

Result result(const Case& c, const stability::Study& study) {
  const auto [cloud, op, evolving] = system(c, study);
  const double unit = std::pow(cloud.spacing(1), 2);
  Result r{.of = c, .points = static_cast<int>(evolving.size()), .forecast = {}};
  r.forecast = forecast(cloud, op.matrix(), evolving, op.volumes);
  r.forecast.rate *= unit;
  const Spectrum all =
      spectrum(principal_part(op.matrix(), evolving), op.volumes(evolving), 2000, 1);
  r.rate = all.rightmost() * unit;
  r.zero = all.zero * unit;
  return r;
}

/// How many matrices of a kind of points grow, and how many were foretold right.
struct Count {
  std::string kind;
  int made = 0, grow = 0, certain = 0, right = 0, false_alarms = 0, missed = 0;

  void add(const Result& r) {
    ++made;
    grow += r.grows();
    certain += r.forecast.certain;
    right += r.forecast.grows == r.grows();
    false_alarms += r.forecast.grows && !r.grows();
    missed += !r.forecast.grows && r.grows();
  }
};

/// Kind by kind, and all together.
std::vector<Count> counts(const std::vector<Result>& results) {
  std::vector<Count> all;
  Count together{.kind = "all"};
  for (const Result& r : results) {
    if (all.empty() || all.back().kind != r.of.kind->name)
      all.push_back({.kind = std::string(r.of.kind->name)});
    all.back().add(r);
    together.add(r);
  }
  all.push_back(together);
  return all;
}

}  // namespace

std::vector<Result> results(const stability::Study& study, const ShowProgress& show) {
  const std::vector<Case> all = cases(study);
  const int total = static_cast<int>(all.size());
  std::vector<std::optional<Result>> found(all.size());
  int done = 0;
  in_chunks(total, 1, study.threads, [&](int k, int) {
    found[k] = result(all[k], study);
#pragma omp critical
    show(++done, total);
  });
  std::vector<Result> results;
  for (auto& r : found) results.push_back(std::move(*r));
  return results;
}

std::string csv(const std::vector<Result>& results, int dimension) {
  return apps::csv(
      {{"points", [](auto& r) { return r.of.kind->name; }},
       {"dimension", [=](auto&) { return dimension; }},
       {"scheme", [](auto& r) { return name(r.of.scheme); }},
       {"support_ratio", [](auto& r) { return r.of.support_ratio; }},
       {"walls", [](auto& r) { return stability::wall_names[static_cast<int>(r.of.walls)]; }},
       {"seed", [](auto& r) { return r.of.seed; }},
       {"evolving", &Result::points},
       {"rate", &Result::rate},
       {"zero", &Result::zero},
       {"grows", [](auto& r) { return static_cast<int>(r.grows()); }},
       {"foretold", [](auto& r) { return static_cast<int>(r.forecast.grows); }},
       {"certain", [](auto& r) { return static_cast<int>(r.forecast.certain); }},
       {"foretold_rate", [](auto& r) { return r.forecast.rate; }}},
      results);
}

std::string table(const std::vector<Result>& results) {
  return "Forecasts on other points, and what the eigenvalues say:\n\n" +
         text_table({{"", &Count::kind, {.width = -26}},
                     {"matrices", &Count::made, {.width = 9}},
                     {"grow", &Count::grow, {.width = 9}},
                     {"certain", &Count::certain, {.width = 9}},
                     {"right", &Count::right, {.width = 9}},
                     {"false alarm", &Count::false_alarms, {.width = 14}},
                     {"missed", &Count::missed, {.width = 9}}},
                    counts(results));
}

}  // namespace gradpsi::apps::foretold
