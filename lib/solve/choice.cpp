#include "solve/choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.hpp"
#include "solve/errors.hpp"
#include "solve/for_petsc.hpp"
#include "solve/methods.hpp"

namespace gradpsi {
namespace {

constexpr int patience = 1'000;  // iterations until LU takes over
constexpr int soon = 100;        // of multigrid, which converges in a few or not at all

bool is_among(const std::vector<Refusal>& refused, Method method) {
  return std::ranges::find(refused, method, &Refusal::method) != refused.end();
}

Preconditioner preconditioner(const Traits& traits, Method method,
                              const std::vector<Refusal>& refused) {
  if (method == Method::Multigrid) return Preconditioner::Points;
  if (is_among(refused, Method::Multigrid) || !traits.has_volumes())
    return Preconditioner::Diagonal;
  return row_of(Method::Multigrid).cost(traits) < row_of(Method::Krylov).cost(traits)
             ? Preconditioner::Points
             : Preconditioner::Diagonal;
}

/// "the matrix is .., of .. unknowns, .."
std::string description(const Traits& traits) {
  std::string text = "the matrix is ";
  text += !traits.symmetric   ? "not symmetric"
          : traits.indefinite ? "symmetric but not positive definite"
          : !traits.dominant  ? "symmetric but not diagonally dominant"
                              : "symmetric";
  text += ", of " + std::to_string(traits.unknowns) + " unknowns";
  if (std::isinf(traits.stiffness))
    text += ", steady";
  else if (traits.has_volumes())
    text += ", with dt nu / dx^2 = " + rounded(traits.stiffness);
  return text + (traits.solves == 1 ? ", to be solved once"
                                    : ", to be solved " + std::to_string(traits.solves) + " times");
}

std::string reason(Method method, const Traits& traits, const std::vector<Refusal>& refused) {
  if (method == Method::Cholesky) return "the matrix is symmetric and positive definite";
  std::string text = description(traits);
  for (const Refusal& refusal : refused) {
    if (refusal.method == Method::Cholesky) return "the matrix is symmetric, but " + refusal.why;
    const std::string whose =
        refusal.method == Method::Lu ? "LU" : std::string(name(refusal.method));
    text += refusal.why.empty() ? ", and memory ran out for " + whose
                                : ", and for " + whose + " " + refusal.why;
  }
  return text;
}

}  // namespace

Choice choose(const Traits& traits, Method asked, const std::vector<Refusal>& refused) {
  if (asked == Method::Cholesky && !traits.symmetric) throw not_symmetric();
  if (asked == Method::Multigrid && !traits.has_volumes()) throw no_volumes();
  Choice result{.method = asked,
                .reason = "as asked",
                .conjugate = traits.symmetric && traits.dominant,
                .preconditioner = preconditioner(traits, asked, refused)};
  if (asked != Method::Auto) return result;
  const auto cost = [&](const MethodRow& row) {
    return is_among(refused, row.method) ? std::numeric_limits<double>::infinity()
                                         : row.cost(traits);
  };
  result.method = std::ranges::min(methods(), {}, cost).method;  // Krylov methods always can
  result.reason = reason(result.method, traits, refused);
  result.preconditioner = preconditioner(traits, result.method, refused);
  result.provisional = iterates(result.method);
  return result;
}

int most_iterations(const Choice& choice, const SolverOptions& options) {
  if (!choice.provisional) return options.max_iterations;
  return std::min(options.max_iterations,
                  choice.preconditioner == Preconditioner::Points ? soon : patience);
}

Preconditioner by_entries(const Traits& traits) {
  // The twin is worth its making where the matrix has long rows or rows that multigrid cannot use.
  return traits.dimension == 3 || traits.walls ? Preconditioner::TwinMultigrid
                                               : Preconditioner::Multigrid;
}

double iterations_by_diagonal(const Traits& traits) {
  const double width = std::pow(static_cast<double>(traits.unknowns), 1.0 / traits.dimension);
  return std::min(15 * std::sqrt(std::max(traits.stiffness, 0.0)), 2 * width);
}

Choice successor(const Choice& choice) {
  return {.method = Method::Lu, .reason = choice.reason + ", and iterations did not converge"};
}

}  // namespace gradpsi
