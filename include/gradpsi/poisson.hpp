#pragma once

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/operator.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Solves lap u = f under boundary conditions, for many f, on points that may move: the pressure of an incompressible
/// flow, a potential, a steady temperature.
///
/// Where nothing fixes u, neither a value nor an exchange, a constant is taken from f (SolveReport::removed) so that
/// there is a solution, and of all that differ by a constant the one is given whose mean by volume is
/// SolverOptions::mean, or else 0.
///
/// Not to be used from two threads at a time.
class Poisson {
 public:
  /// @param cloud       n points
  /// @param laplacian   all n rows
  /// @param conditions  at fixed points and walls
  /// @param solver      tolerance and method; solves: how many f there will be for each matrix, 0: one
  /// @throws InvalidInput, SolverError  as ImplicitDiffusion
  Poisson(const Cloud& cloud, const Operator& laplacian, BoundaryConditions conditions = {},
          const SolverOptions& solver = {});

  /// @param f  n finite values; at fixed points and walls any
  /// @param u  n values: where iterations start from, and what fixed points keep if their condition has no values;
  ///   then the solution
  /// @throws InvalidInput  if a size is wrong or a value is not finite (names the point)
  /// @throws SolverError  as LinearSolver::solve(); u is then what it was
  SolveReport solve(const VectorView& f, Eigen::Ref<Eigen::VectorXd> u);

  /// The same problem where the points are now. Multigrid keeps its coarser points as long as they serve.
  /// @throws as ImplicitDiffusion::update(); InvalidInput, too, where there are walls, whose gradient is another one
  ///   by now: give all conditions, then
  void update(const Cloud& cloud, const Operator& laplacian);
  /// Other conditions, too.
  void update(const Cloud& cloud, const Operator& laplacian, BoundaryConditions conditions);

  const SolverReport& solver() const { return step_.solver(); }  ///< what is used, and why

 private:
  BoundaryConditions conditions_;
  ImplicitDiffusion step_;
};

}  // namespace gradpsi
#pragma GCC visibility pop
