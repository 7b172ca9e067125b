#pragma once

#include <Eigen/Core>
#include <vector>

#include "gradpsi/cloud.hpp"
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
/// 1999). Both keep row sums zero and symmetry after scaling by volume.
///
/// @param laplacian     as assembled, all rows or some
/// @param conductivity  n numbers kappa_i > 0
/// @param mean          Arithmetic or Harmonic
/// @throws InvalidInput  if sizes disagree or a kappa is out of range (names the point)
Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity,
                           Mean mean = Mean::Arithmetic);

/// Points whose value is known (Dirichlet).
struct FixedValues {
  std::vector<int> points = {};  ///< 0-based, each once
  Eigen::VectorXd values = {};   ///< one per point; empty: each keeps the value it has
};

/// Points where transfer u + n . grad u = flux holds instead of the equation: Neumann, or with
/// transfer > 0 Robin.
struct WallConditions {
  std::vector<int> points = {};  ///< 0-based, each once, none of them fixed
  Positions normals = {};        ///< points x d: n, not 0, of any length; outward by convention
  std::vector<SparseMatrix> gradient = {};  ///< d matrices, points x n: grad u at these points
  Eigen::VectorXd flux = {};                ///< one per point; empty: 0
  Eigen::VectorXd transfer = {};            ///< one per point, >= 0 (1/length); empty: 0
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
  /// 1: backward Euler, order 1; 0.5: Crank-Nicolson, order 2 from a field that meets the wall
  /// conditions (a step of hardly any length makes it do so); 0.5 to 1.
  double theta = 1;
  Eigen::VectorXd source = {};  ///< f, n values; empty: 0
  SolverOptions solver = {};    ///< of the system of each step
};

/// The linear system A x = b of a step of du/dt = nu lap u + f by the theta method with a Laplacian's
/// matrix Psi,
///
///     (I/dt - theta nu Psi) u^{n+1} = (I/dt + (1 - theta) nu Psi) u^n + f
///
/// at points without a condition: for ImplicitDiffusion and for solvers of one's own. Fixed points are
/// eliminated, their columns going to the right-hand side, so that a symmetric matrix stays one. An
/// infinite dt with theta = 1 is the steady problem -nu Psi u = f.
///
/// The Laplacian may have some of the points' rows only, AssemblyOptions::rows: then so has the system,
/// and its columns are the unknowns among all points. So a process assembles its own rows of a larger
/// system, given the points around its own.
class DiffusionSystem {
 public:
  /// @param cloud       n points
  /// @param laplacian   m rows
  /// @param conditions  fixed points: all of the cloud's; walls: those that have a row
  /// @param options     all but how it is solved
  /// @throws InvalidInput  if sizes disagree, a number is out of range or not finite, a point is named
  ///   twice or has two conditions
  DiffusionSystem(const Cloud& cloud, const Operator& laplacian,
                  const BoundaryConditions& conditions, const DiffusionOptions& options);

  SparseMatrix
      matrix;  ///< A: a row for each of rows(), a column for each of columns(); may be moved out
  SystemPoints points;  ///< what a solver may know of the rows beside A; may be moved out
  /// The points whose rows these are: the Laplacian's but for fixed ones, in their order.
  const std::vector<int>& rows() const { return rows_; }
  /// The points whose value is unknown, ascending; if the Laplacian has all rows, the same as rows().
  const std::vector<int>& columns() const { return columns_; }

  /// Writes b for a field u.
  /// @param u        n values, finite
  /// @param product  A u at the rows, for columns() of u; not looked at if theta is 1
  /// @param b        one number a row
  void right_hand_side(const double* u, const double* product, double* b);
  /// Whether right_hand_side() needs a product.
  bool needs_product() const { return theta_ < 1; }
  /// Puts prescribed values in their place among u's n.
  void set_fixed(double* u) const;

  /// Changes the entries of `matrix` to those of another time step, or of such a matrix kept elsewhere.
  /// @throws InvalidInput  if the step is out of range
  void set_time_step(double time_step, SparseMatrix& matrix);

 private:
  struct WallRow {
    int row;
    double size;       // its largest entry, with the sign of the diagonal
    double diffusion;  // theta nu |psi_ii|
    double scale;      // what the row is multiplied by
  };
  std::vector<int> choose_rows(const Operator& laplacian, const std::vector<int>& fixed_place);
  void add_rate(const Cloud& cloud);
  static double row_scale(const WallRow& wall, double rate);
  double* diagonal(SparseMatrix& matrix, int row) const;

  std::vector<int> rows_, columns_;
  FixedValues fixed_;
  std::vector<WallRow> walls_;
  std::vector<int> diagonal_places_;  // each row's point among the columns
  Eigen::VectorXd evolves_;   // 1 for rows with the equation, 0 for those with a wall condition
  Eigen::VectorXd diagonal_;  // of the matrix without 1/dt, where rows evolve
  SparseMatrix coupling_;     // rows x fixed: what known values add to the right-hand side
  Eigen::VectorXd constant_;  // what source and flux add
  double time_step_, theta_;
  int threads_;
  Eigen::VectorXd known_;  // workspace of right_hand_side()
};

/// Steps du/dt = nu lap u + f: see DiffusionSystem. A steady problem is solved by a single step from any u.
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

  /// Replaces u (n, or n x k for k fields at once) at one time by u at the next. Allocates as
  /// little as LinearSolver::solve().
  /// @throws InvalidInput  if the size is wrong or a value is not finite (names the point)
  /// @throws SolverError  as LinearSolver::solve(); u is then what it was
  SolveReport step(Eigen::Ref<Eigen::MatrixXd> u);

  /// Another time step: the matrix is factorised anew, and analysed only if another method is chosen.
  /// @throws as LinearSolver::refactor()
  void set_time_step(double time_step);

  /// What the system is solved with, and why.
  const SolverReport& solver() const { return solver_.report(); }

 private:
  int points_;
  DiffusionSystem system_;
  LinearSolver solver_;
  int threads_;
  Eigen::VectorXd product_;  // workspace of step()
  Eigen::MatrixXd rhs_, solution_;
};

}  // namespace gradpsi
#pragma GCC visibility pop
