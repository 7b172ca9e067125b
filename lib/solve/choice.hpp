#pragma once

#include <string>
#include <vector>

#include "solve/traits.hpp"

namespace gradpsi {

/// What makes iterations fewer.
enum class Preconditioner {
  Diagonal,
  Points,        // multigrid on coarser points, see multigrid.hpp
  Multigrid,     // of the matrix, by its entries
  TwinMultigrid  // of its twin
};

/// How a system is to be solved, and why.
struct Choice {
  Method method = Method::Auto;
  std::string reason = {};
  bool conjugate = false;  // gradients; else BiCGSTAB
  Preconditioner preconditioner = Preconditioner::Diagonal;
  bool provisional = false;  // the successor takes over if iterations do not converge soon
};

/// A method that fits and cannot serve.
struct Refusal {
  Method method;
  std::string why = {};  // "its factor would take .."; empty: memory ran out
};

/// What a system with these traits is solved with, on one machine and on several processes.
/// @param asked    Auto: the first method that fits; else this one
/// @param refused  what has been tried in vain
/// @throws InvalidInput  if Cholesky is asked for and the matrix is not symmetric
Choice choose(const Traits& traits, Method asked, const std::vector<Refusal>& refused = {});

/// What serves by BoomerAMG where multigrid on the points cannot.
Preconditioner by_entries(const Traits& traits);

/// The iterations that conjugate gradients with the diagonal would take to a relative residual of 1e-8: they grow
/// with a step's reach, sqrt(dt nu), until that is the whole domain. NaN without volumes.
double iterations_by_diagonal(const Traits& traits);

/// Whether a method iterates rather than factorises the matrix.
bool iterates(Method method);

/// How many iterations the choice has before another one takes over or they are given up.
int most_iterations(const Choice& choice, const SolverOptions& options);

/// What takes over from one whose iterations do not converge.
Choice successor(const Choice& choice);

}  // namespace gradpsi
