#include "solve/choice.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "solve/errors.hpp"
#include "solve/for_petsc.hpp"
#include "solve/methods.hpp"

namespace gradpsi {
namespace {

// Where preconditioners cross over, measured in benchmarks/README.md: dt nu / dx^2 above which a twin's factor
// does better than the diagonal, and the diagonal's iterations above which multigrid is worth its set-up.
constexpr double stiff = 100;
constexpr double many = 60;
constexpr int patience = 1'000;  // iterations until LU takes over

/// The iterations that the diagonal would take: they grow with a step's reach, sqrt(dt nu), until that is the
/// whole domain.
double iterations_by_diagonal(const Traits& traits) {
  const double width = std::pow(static_cast<double>(traits.unknowns), 1.0 / traits.dimension);
  return std::min(10 * std::sqrt(traits.stiffness), 1.3 * width);
}

Preconditioner preconditioner(const Traits& traits) {
  if (!traits.spread)
    return traits.stiffness > stiff && traits.dimension < 3 ? Preconditioner::Twin
                                                            : Preconditioner::Diagonal;
  if (!(iterations_by_diagonal(traits) > many)) return Preconditioner::Diagonal;
  // The twin is worth its making where the matrix has long rows or rows that multigrid cannot use.
  return traits.dimension == 3 || traits.walls ? Preconditioner::TwinMultigrid
                                               : Preconditioner::Multigrid;
}

/// "the matrix is .., of .. unknowns, .."
std::string description(const Traits& traits) {
  std::string text = "the matrix is ";
  text += !traits.symmetric   ? "not symmetric"
          : traits.indefinite ? "symmetric but not positive definite"
          : !traits.dominant  ? "symmetric but not diagonally dominant"
                              : "symmetric";
  text += ", of " + std::to_string(traits.unknowns) + " unknowns";
  if (!std::isnan(traits.stiffness)) text += ", with dt nu / dx^2 = " + rounded(traits.stiffness);
  return text;
}

std::string reason(Method method, const Traits& traits, const std::vector<Refusal>& refused) {
  if (method == Method::Cholesky) return "the matrix is symmetric and positive definite";
  std::string text = description(traits);
  for (const Refusal& refusal : refused) {
    if (refusal.method == Method::Cholesky) return "the matrix is symmetric, but " + refusal.why;
    text += refusal.why.empty() ? ", and memory ran out for LU" : ", and for LU " + refusal.why;
  }
  return text;
}

bool is_among(const std::vector<Refusal>& refused, Method method) {
  return std::ranges::find(refused, method, &Refusal::method) != refused.end();
}

}  // namespace

Choice choose(const Traits& traits, Method asked, const std::vector<Refusal>& refused) {
  if (asked == Method::Cholesky && !traits.symmetric) throw not_symmetric();
  Choice result{.method = asked,
                .reason = "as asked",
                .conjugate = traits.symmetric && traits.dominant,
                .preconditioner = preconditioner(traits)};
  if (asked != Method::Auto) return result;
  const auto fits = [&](const MethodRow& row) {
    return row.fits(traits) && !is_among(refused, row.method);
  };
  result.method = std::ranges::find_if(methods(), fits)->method;  // Krylov methods always do
  result.reason = reason(result.method, traits, refused);
  result.provisional = iterates(result.method);
  return result;
}

int most_iterations(const Choice& choice, const SolverOptions& options) {
  return choice.provisional ? std::min(options.max_iterations, patience) : options.max_iterations;
}

Choice successor(const Choice& choice) {
  return {.method = Method::Lu, .reason = choice.reason + ", and iterations did not converge"};
}

}  // namespace gradpsi
