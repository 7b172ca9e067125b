#include "tolerance/stable.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <string>

#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spectrum.hpp"

namespace gradpsi {
namespace {

/// As many points as a block of forecast() has, to begin with.
constexpr int block = 30;

/// The points around the growth, and those whose discs reach at least as far to the right as the furthest there.
std::vector<int> suspects(RowChoice& choice, const SparseMatrix& A,
                          const std::vector<int>& evolving, int point) {
  double furthest = 0;
  std::vector<int> found;
  std::ranges::set_intersection(choice.around(point, block), evolving, std::back_inserter(found));
  for (const int i : found) furthest = std::max(furthest, gershgorin_reach(A, i, i));
  std::vector<int> all;
  for (const int i : evolving)
    if (std::ranges::binary_search(found, i) || gershgorin_reach(A, i, i) >= furthest)
      all.push_back(i);
  return all;
}

}  // namespace

void make_stable(RowChoice& choice, const std::vector<int>& fixed) {
  const Cloud& cloud = choice.cloud();
  std::vector<int> all(cloud.size()), evolving, exchanged;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::set_difference(all, fixed, std::back_inserter(evolving));
  for (;;) {
    const Operator op = choice.rows().operator_of(choice.volumes());
    const Forecast growth = forecast(cloud, op.matrix(), evolving, op.volumes);
    if (!growth.grows) return;
    std::vector<int> points, now;
    std::ranges::set_difference(suspects(choice, op.matrix(), evolving, growth.point), exchanged,
                                std::back_inserter(points));
    if (points.empty())
      throw SolverError("solutions grow at point " + std::to_string(cloud.number(growth.point)) +
                        " (at " + coordinates(cloud.positions(), growth.point) +
                        ") with every row that is good enough; are boundary points fixed?");
    choice.choose_anew(points);
    std::ranges::set_union(exchanged, points, std::back_inserter(now));
    exchanged = std::move(now);
  }
}

}  // namespace gradpsi
