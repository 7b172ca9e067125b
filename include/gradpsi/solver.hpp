#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// How a linear system is solved.
enum class Method {
  Auto,      ///< what LinearSolver finds fit for the matrix
  Cholesky,  ///< CHOLMOD, for symmetric positive definite matrices only
  Lu,        ///< UMFPACK, for any regular matrix
  Krylov     ///< conjugate gradients or BiCGSTAB, preconditioned
};
std::string_view name(Method method);  ///< "auto", "cholesky", "lu", "krylov"
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
  /// 0 to 1024; 0: as many as OpenMP offers. Krylov methods do not depend on it to the last bit.
  int threads = 0;
};

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
  FactorReport factor = {};      ///< in a Krylov method the preconditioner's, if that is a factor
  /// Rows that may keep a Krylov method from converging, those of whose diagonal entries the sign is not that of
  /// most, as where a field grows: "of 3 rows ..: point 5, .."; empty: none.
  std::string caution = {};
};

/// How a solve went.
struct SolveReport {
  double residual =
      0;  ///< true relative residual |b - A x| / |b|, the largest of all columns; 0 for b = 0
  int iterations = 0;  ///< of a Krylov method, all columns together; else steps of refinement
  double seconds = 0;  ///< wall clock
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
/// Auto takes Cholesky if diag(volumes) A is symmetric, entry by entry, and its factorisation finds it
/// positive definite; for other matrices LU, or BiCGSTAB where there are too many unknowns for LU or
/// time steps are short. Where a factor would not fit the memory, a Krylov method takes over:
/// conjugate gradients if A is symmetric and diagonally dominant, else BiCGSTAB; LU takes over from one
/// that does not converge in 1,000 iterations, if it fits. Where SolverReport::caution names rows, LU comes first
/// if it fits, and 1,000 iterations have to halve the residual. They are
/// preconditioned by the diagonal; in stiff problems in one and two dimensions by the factor of a compact
/// symmetric twin. report() tells what was chosen and why.
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
  ///   null space, or a pivot is zero); if Method::Cholesky is asked for and it is not positive
  ///   definite; if a factor asked for would not fit the memory
  /// @throws std::bad_alloc  if memory runs out all the same
  explicit LinearSolver(SparseMatrix matrix, SolverOptions options = {}, SystemPoints points = {});
  /// What was moved from can only be destroyed or assigned to.
  LinearSolver(LinearSolver&&) noexcept;
  /// As the constructor.
  LinearSolver& operator=(LinearSolver&&) noexcept;
  ~LinearSolver();

  /// Other values in the same pattern; the symbolic analysis is kept where the method remains.
  /// @throws as the constructor, after which there is nothing to solve with until a refactor() succeeds;
  ///   InvalidInput if the pattern is not the same, and all is as before
  void refactor(SparseMatrix matrix);

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
