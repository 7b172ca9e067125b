#include "solve/methods.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "base/text.hpp"
#include "solve/direct.hpp"
#include "solve/for_petsc.hpp"
#include "solve/iterative.hpp"

namespace gradpsi {
namespace {

// Where LU and Krylov methods cross over, measured in benchmarks/README.md.
constexpr double mild = 3;        // dt nu / dx^2 up to which the diagonal preconditions well
constexpr int always_lu = 2'000;  // unknowns
constexpr int most_lu = 300'000;  // in one and two dimensions
constexpr int most_lu_3d = 20'000;

bool never(const Traits&) { return false; }
bool always(const Traits&) { return true; }

bool fits_cholesky(const Traits& traits) {
  return traits.symmetric && !traits.indefinite && !traits.spread;
}

bool fits_lu(const Traits& traits) {
  const bool easy = traits.unknowns > always_lu && traits.stiffness <= mild && !traits.reversed;
  const bool small = traits.unknowns <= (traits.dimension == 3 ? most_lu_3d : most_lu);
  return (!traits.symmetric || traits.indefinite) && !traits.spread && !easy && small;
}

constexpr std::array<MethodRow, 4> rows = {
    {{Method::Auto, "auto", false, never, nullptr},
     {Method::Cholesky, "cholesky", false, fits_cholesky, make_cholesky},
     {Method::Lu, "lu", false, fits_lu, make_lu},
     {Method::Krylov, "krylov", true, always, make_krylov}}};

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
