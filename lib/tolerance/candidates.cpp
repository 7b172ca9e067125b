#include "tolerance/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>

namespace gradpsi {
namespace {

/// A row of the table.
struct Family {
  const char* scheme;                        // its name without the derivative
  std::initializer_list<double> neighbours;  // a condition
  double entries = 0;  // of a row, a condition, where they are fewer than its neighbours
  std::initializer_list<double> further = {};  // where fields must not grow
};

/// With fewer neighbours rows are nearly singular or have large weights; with more, the next degree has the
/// smaller error.
constexpr Family families[] = {
    {"positive", {2.4}, 1, {5, 10}}, {"ls-1", {1.5, 2.5}},      {"ls-2", {1.2, 1.4, 1.6, 1.9, 2.4}},
    {"ls-3", {1.2, 1.45, 1.7}},      {"ls-4", {1.2, 1.4, 1.7}}, {"ls-5", {1.2, 1.4}},
    {"ls-6", {1.2, 1.4, 1.7}},
};

}  // namespace

std::vector<RowCandidate> row_candidates(Derivative derivative, int dimension, bool stable) {
  std::vector<std::pair<double, RowCandidate>> all;
  for (const Family& family : families) {
    const std::string wanted = std::string(name(derivative)) + '-' + family.scheme;
    const auto found = std::ranges::find_if(schemes(), [&](auto& s) { return name(s) == wanted; });
    if (found == schemes().end()) continue;
    const double conditions = unknowns(*found, dimension);
    const auto add = [&](double ratio) {
      const RowCandidate next{*found, static_cast<int>(std::ceil(ratio * conditions))};
      all.emplace_back(family.entries > 0 ? family.entries * conditions : next.neighbours, next);
    };
    std::ranges::for_each(family.neighbours, add);
    if (stable) std::ranges::for_each(family.further, add);
  }
  std::ranges::stable_sort(all, {}, [](const auto& each) { return each.first; });
  std::vector<RowCandidate> result;
  for (const auto& [entries, next] : all)
    if (result.empty() || !(result.back().scheme == next.scheme) ||
        result.back().neighbours != next.neighbours)
      result.push_back(next);
  return result;
}

}  // namespace gradpsi
