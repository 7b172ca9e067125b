#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/solver_options.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// What a factorisation took.
struct FactorReport {
  std::string description;     ///< "CHOLMOD, supernodal, ordered by ..."
  double entries = 0;          ///< of L, or of L and U
  double flops = 0;            ///< 0: not known
  double bytes = 0;            ///< of memory that it holds
  double analyse_seconds = 0;  ///< ordering and symbolic analysis
  double factor_seconds = 0;   ///< the latest numerical factorisation
};

/// What a linear system is solved with, and why.
struct SolverReport {
  Method method = Method::Auto;  ///< not Auto where there is a solver
  std::string description;       ///< "BiCGSTAB preconditioned by ..."
  std::string reason;            ///< "the matrix is not symmetric, ..."
  int unknowns = 0;              ///< n
  FactorReport factor = {};      ///< or of a Krylov method's preconditioner, its hierarchy
  bool iterates = false;         ///< a solve counts iterations, not refinements
  /// Rows whose diagonal entries have not the sign of most, as where a field grows: they may keep iterations with the
  /// diagonal from converging. "of 3 rows ..: point 5, .."; empty: none.
  std::string caution = {};
  double setup_seconds = 0;  ///< wall clock of the latest constructor or refactor()
};

/// How a solve went.
struct SolveReport {
  double residual = 0;  ///< true |b - A x| / |b|, the largest of all columns; 0 for b = 0
  int iterations = 0;   ///< of a Krylov method, all columns together; else steps of refinement
  double seconds = 0;   ///< wall clock
  double removed = 0;   ///< with SolverOptions::mean: the largest |c| of all columns
};

/// The points that a matrix's rows and columns belong to: what a solver may know beyond the entries.
struct SystemPoints {
  /// n points, or none; with volumes, rows times volumes are tried for symmetry. Messages name row i by
  /// the number of its point.
  Cloud cloud = Cloud(Positions(0, 1));
  /// Rows that hold a boundary condition rather than the equation of the others, each once.
  std::vector<int> walls = {};
};

/// Solves A x = b for many b: the constructor chooses a method and factorises, solve() can then be
/// called again and again.
///
/// Auto takes what is likely to be fastest for preparing the matrix and SolverOptions::solves solves: Cholesky if
/// diag(volumes) A is symmetric, entry by entry, and its factorisation finds it positive definite; LU for other
/// matrices; or a Krylov method: conjugate gradients if A is symmetric and diagonally dominant, else
/// BiCGSTAB, preconditioned by the diagonal or by multigrid on the points. Where a factor would not fit the memory,
/// another method takes over, and LU takes over from iterations that do not converge soon, if it fits. Where
/// SolverReport::caution names rows, 1,000 iterations have to halve the residual. report() tells what is used.
///
/// Not to be used from two threads at a time; two solvers may. While one factorises or solves, it sets
/// OpenBLAS's number of threads, which belongs to the process, and restores it afterwards.
class LinearSolver {
 public:
  /// @param matrix   n x n, n >= 0, compressed
  /// @param options  method, tolerance, limits
  /// @param points   what is known of the unknowns beside the matrix; none: coordinates are not used
  /// @throws InvalidInput  if it is not square, sizes disagree, an option is out of range, an entry is
  ///   not finite, a row has only zeros; if Method::Cholesky is asked for and diag(volumes) A is not
  ///   symmetric
  /// @throws SolverError  if the matrix is singular (constants on a connected set of points are in its
  ///   null space, but for what SolverOptions::mean allows, or a pivot is zero); if Method::Cholesky is asked for and it is not positive
  ///   definite; if a factor asked for would not fit the memory
  /// @throws std::bad_alloc  if memory runs out all the same
  explicit LinearSolver(SparseMatrix matrix, SolverOptions options = {}, SystemPoints points = {});
  /// What was moved from can only be destroyed or assigned to.
  LinearSolver(LinearSolver&&) noexcept;
  /// As the constructor.
  LinearSolver& operator=(LinearSolver&&) noexcept;
  ~LinearSolver();

  /// Other values in the same pattern; the symbolic analysis is kept where the method remains, and multigrid's
  /// coarser points where the values are nearly multiples.
  /// @throws as the constructor, after which there is nothing to solve with until a refactor() succeeds;
  ///   InvalidInput if the pattern is not the same, and all is as before
  void refactor(SparseMatrix matrix);

  /// Another matrix for the same unknowns, as when points have moved a little: multigrid keeps its coarser points as
  /// long as they serve. Otherwise as a new solver with the options of this one.
  /// @throws as the constructor, after which there is nothing to solve with until an update() succeeds
  void update(SparseMatrix matrix, SystemPoints points);

  /// Solves for every column of b (n x k). x (n x k) is where iterations start from.
  /// Allocates nothing if the call before had as many columns (but for what a BLAS may do for itself when
  /// there are several, and in a build without CHOLMOD).
  /// @throws InvalidInput  if sizes disagree or b or x is not finite
  /// @throws SolverError  if the residual stays above the tolerance and above what rounding allows
  SolveReport solve(const MatrixView& b, Eigen::Ref<Eigen::MatrixXd> x);

  const SolverReport& report() const;  ///< what is used, and why
  const SparseMatrix& matrix() const;  ///< the latest one given

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gradpsi
#pragma GCC visibility pop
