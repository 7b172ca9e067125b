#pragma once

#include <memory>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/solver.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Of the conductivities of two points.
enum class Mean {
  Arithmetic,  ///< (a + b) / 2, for conductivities that change smoothly
  Harmonic     ///< 2 a b / (a + b), for jumps
};

/// The Laplacian's rows made those of div(kappa grad u): psi_ij times the mean of kappa_i and kappa_j.
///
/// Arithmetic: exactly half of lap(kappa u) + kappa lap u - u lap kappa, so as consistent as the
/// Laplacian where kappa is smooth. Harmonic, 2 kappa_i kappa_j / (kappa_i + kappa_j): for jumps,
/// across which the flux is then continuous (P. W. Cleary and J. J. Monaghan, J. Comput. Phys. 148,
/// 1999). Both keep row sums zero and symmetry after scaling by volume. What rows sum to otherwise, the exchange of
/// with_walls(), is taken times kappa_i.
///
/// @param laplacian     as assembled, all rows or some
/// @param conductivity  n numbers kappa_i > 0
/// @param mean          Arithmetic or Harmonic
/// @throws InvalidInput  if sizes disagree or a kappa is out of range (names the point)
Operator with_conductivity(Operator laplacian, const VectorView& conductivity,
                           Mean mean = Mean::Arithmetic);

/// The same by the product rule, kappa lap u + grad kappa . grad u: K Psi + sum_a diag(G_a kappa) G_a. As
/// accurate where kappa is smooth, never symmetric, and wrong across jumps.
/// @param laplacian     as assembled, all rows or some
/// @param gradient      d matrices of the same rows and the same pattern
/// @param conductivity  n numbers kappa_i > 0
/// @throws InvalidInput  as above, or if the rows or patterns of the two operators disagree
Operator with_conductivity(Operator laplacian, const Operator& gradient,
                           const VectorView& conductivity);

/// Points whose value is known (Dirichlet).
struct FixedValues {
  std::vector<int> points = {};  ///< 0-based, each once
  DenseVector values = {};       ///< one per point; empty: each keeps the value it has
};

/// Points where transfer u + n . grad u = flux holds instead of the equation: Neumann, or with
/// transfer > 0 Robin.
struct WallConditions {
  std::vector<int> points = {};  ///< 0-based, each once, none of them fixed
  Positions normals = {};        ///< points x d: n, not 0, of any length; outward by convention
  std::vector<SparseMatrix> gradient = {};  ///< d matrices, points x n: grad u at these points
  DenseVector flux = {};                    ///< one per point; empty: 0
  DenseVector transfer = {};                ///< one per point, >= 0 (1/length); empty: 0
};

/// A point without a condition obeys the equation; near the edge of an open cloud without any, zoc
/// schemes imply zero flux.
struct BoundaryConditions {
  FixedValues fixed = {};     ///< where u is known
  WallConditions walls = {};  ///< where its slope is
};

/// The equation du/dt = nu lap u + f, its steps, and how they are solved.
struct DiffusionOptions {
  double diffusivity = 1;  ///< nu >= 0, length^2/time
  double time_step = 0;    ///< dt > 0; infinity: the steady problem
  /// 1: backward Euler, order 1; 0.5: Crank-Nicolson, order 2 from a field that is smooth and meets the
  /// wall conditions, from others if ImplicitDiffusion::damped_step() comes first; 0.5 to 1.
  double theta = 1;
  DenseVector source = {};    ///< f, n values; empty: 0
  SolverOptions solver = {};  ///< of the system of each step
};

/// Steps du/dt = nu lap u + f by the theta method: see DiffusionSystem in system.hpp. A steady problem is
/// solved by a single step from any u.
///
/// The matrix is factorised once; step() then costs a solve. Not to be used from two threads at a time.
class ImplicitDiffusion {
 public:
  /// @param cloud       n points
  /// @param laplacian   all n rows
  /// @param conditions  at fixed points and walls
  /// @param options     the equation, the step, the solver
  /// @throws InvalidInput  as DiffusionSystem, or if the Laplacian has some rows only
  /// @throws SolverError  as LinearSolver, naming points
  ImplicitDiffusion(const Cloud& cloud, const Operator& laplacian,
                    const BoundaryConditions& conditions, const DiffusionOptions& options);

  /// What was moved from can only be destroyed or assigned to.
  ImplicitDiffusion(ImplicitDiffusion&&) noexcept;
  /// As the constructor.
  ImplicitDiffusion& operator=(ImplicitDiffusion&&) noexcept;
  ~ImplicitDiffusion();

  /// Replaces u (n, or n x k for k fields at once) at one time by u at the next. Allocates as
  /// little as LinearSolver::solve().
  /// @throws InvalidInput  if the size is wrong or a value is not finite (names the point)
  /// @throws SolverError  as LinearSolver::solve(); u is then what it was
  SolveReport step(Eigen::Ref<Eigen::MatrixXd> u);

  /// In place of a step by Crank-Nicolson two backward Euler steps of dt/2, which have the same matrix: no other
  /// factorisation, two solves. As the first step from a field that jumps or does not meet the walls' conditions
  /// it damps what Crank-Nicolson would let oscillate; steps that follow are of order 2 as ever (R. Rannacher,
  /// Numer. Math. 43, 1984). Copies u.
  /// @throws InvalidInput  as step(), or if theta is not 0.5
  /// @throws SolverError  as step()
  SolveReport damped_step(Eigen::Ref<Eigen::MatrixXd> u);

  /// @name What drives it
  /// Other numbers where there are such conditions; the matrix remains, and its factor or hierarchy.
  /// @throws InvalidInput  if the size is wrong or a value is not finite (names the point); all is as before
  /// @{
  void set_source(const VectorView& source);  ///< f, n values; empty: 0
  void set_fixed_values(
      DenseVector values);  ///< one per fixed point; empty: each keeps the value it has
  void set_flux(const VectorView& flux);  ///< one per wall point; empty: 0
  /// @}

  /// Another time step: the matrix is factorised anew, and analysed only if another method is chosen.
  /// @throws as LinearSolver::refactor()
  void set_time_step(double time_step);

  /// Other points, or the same ones elsewhere, with what holds there: the equation, the source and the solver's
  /// options remain, and multigrid keeps its coarser points as long as they serve.
  /// @throws as the constructor, after which there may be nothing to step with until an update() succeeds
  void update(const Cloud& cloud, const Operator& laplacian, const BoundaryConditions& conditions);

  /// What the system is solved with, and why.
  const SolverReport& solver() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gradpsi
#pragma GCC visibility pop
