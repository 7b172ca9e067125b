#pragma once

#include <functional>
#include <optional>
#include <string_view>

#pragma GCC visibility push(default)
namespace gradpsi {

/// How a linear system is solved.
enum class Method {
  Auto,      ///< what LinearSolver finds fit for the matrix
  Cholesky,  ///< CHOLMOD, for symmetric positive definite matrices only
  Lu,        ///< UMFPACK, for any regular matrix
  Krylov,    ///< conjugate gradients or BiCGSTAB, preconditioned
  Multigrid  ///< the same, preconditioned by multigrid on the points, which must have volumes
};
std::string_view name(Method method);  ///< "auto", "cholesky", "lu", "krylov", "multigrid"
/// @throws InvalidInput  listing the valid names, nearest spelling first
Method method(std::string_view name);

/// The order in which a factorisation eliminates the unknowns. A build without CHOLMOD takes AMD for
/// METIS, and COLAMD in LU.
enum class Ordering {
  Coordinates,  ///< nested dissection by the points' coordinates: METIS's fill in a tenth of its time
  Amd,          ///< approximate minimum degree; what is used where there are no coordinates
  Metis         ///< METIS, as CHOLMOD calls it
};
std::string_view name(Ordering ordering);  ///< "nested dissection by coordinates", "AMD", "METIS"

/// How a LinearSolver goes about its work.
struct SolverOptions {
  Method method = Method::Auto;  ///< Auto: by looking at the matrix
  double tolerance = 1e-12;      ///< largest relative residual |b - A x| / |b| (2-norms), 0 to 1
  int max_iterations = 10'000;   ///< for each right-hand side, at least 1
  Ordering ordering = Ordering::Coordinates;  ///< of a factorisation's unknowns
  double memory = 0;  ///< bytes that a factorisation may take; 0: three quarters of the machine's
  /// 0 to 1024; 0: as many as OpenMP offers. Krylov methods and multigrid do not depend on it to the last bit.
  int threads = 0;
  /// About how many right-hand sides each matrix is for: Auto weighs preparing against solving. 0: 100, and for a
  /// steady ImplicitDiffusion or Poisson 1.
  int solves = 0;
  /// What solutions' mean by volume is to be, where any constant may be added to them: then A x + c = b is solved,
  /// c being what has to be taken from b for that. None: such a matrix is an error.
  std::optional<double> mean = {};
  /// Called after each iteration of a Krylov method with its number, from 1, all right-hand sides together, and the
  /// relative residual by its recursion. What it throws ends the solve.
  std::function<void(int iteration, double residual)> progress = {};
};

}  // namespace gradpsi
#pragma GCC visibility pop
