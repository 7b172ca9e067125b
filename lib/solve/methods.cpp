#include "solve/methods.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/text.hpp"
#include "solve/direct.hpp"
#include "solve/for_petsc.hpp"
#include "solve/iterative.hpp"

namespace gradpsi {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int few = 500;  // unknowns, where whatever is surest is fast
constexpr int most_lu =
    300'000;  // unknowns, in one and two dimensions, or where these are not known
constexpr int most_lu_3d = 20'000;

// Costs are fits to what benchmarks/README.md measures, on jittered points with some 28 entries a row in two
// dimensions and 70 in three.

double never(const Traits&) { return infinite; }

/// Of a factor of a symmetric matrix.
double factor_cost(const Traits& traits) {
  const auto n = static_cast<double>(traits.unknowns);
  if (n <= few) return 0;
  if (traits.dimension == 3) return 200 + 0.03 * n + traits.solves * (2 + 0.4 * std::cbrt(n));
  return traits.dimension == 2 ? 100 + 0.8 * std::sqrt(n) + 8.0 * traits.solves
                               : 50 + 4.0 * traits.solves;
}

double cholesky_cost(const Traits& traits) {
  return traits.symmetric && !traits.indefinite && !traits.spread ? factor_cost(traits) : infinite;
}

double lu_cost(const Traits& traits) {
  const bool small = traits.unknowns <= (traits.dimension == 3 ? most_lu_3d : most_lu);
  const bool needed = !traits.symmetric || traits.indefinite;
  return needed && small && !traits.spread ? 2.5 * factor_cost(traits) : infinite;
}

double krylov_cost(const Traits& traits) {
  // Iterations of a matrix of which nothing is known, or that lets fields grow, may take for ever.
  if (!traits.has_volumes() || traits.reversed) return std::numeric_limits<double>::max();
  return traits.solves * iterations_by_diagonal(traits);
}

double multigrid_cost(const Traits& traits) {
  if (!traits.has_volumes()) return infinite;
  const bool long_rows = traits.dimension == 3;
  const double set_up = long_rows ? 35 : 50, solve = long_rows ? 35 : 60;
  return set_up + traits.solves * solve;
}

constexpr std::array<MethodRow, 5> rows = {
    {{Method::Auto, "auto", false, never, nullptr},
     {Method::Cholesky, "cholesky", false, cholesky_cost, make_cholesky},
     {Method::Lu, "lu", false, lu_cost, make_lu},
     {Method::Krylov, "krylov", true, krylov_cost, make_krylov},
     {Method::Multigrid, "multigrid", true, multigrid_cost, make_krylov}}};

}  // namespace

std::span<const MethodRow> methods() { return rows; }

const MethodRow& row_of(Method method) {
  return *std::ranges::find(rows, method, &MethodRow::method);
}

bool iterates(Method method) { return row_of(method).iterates; }

std::string_view name(Method method) { return row_of(method).name; }

Method method(std::string_view name) {
  std::vector<std::string> valid;
  for (const MethodRow& row : rows) {
    if (row.name == name) return row.method;
    valid.emplace_back(row.name);
  }
  throw_unknown("method", name, valid);
}

}  // namespace gradpsi
