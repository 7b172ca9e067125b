#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "gradpsi/assemble.hpp"
#include "gradpsi/solver.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Points whose nearest neighbour is nearer than this part of the usual distance are worth a warning.
inline constexpr double much_closer = 0.01;

/// So are coordinates whose rounding is this part of the usual distance or more.
inline constexpr double much_rounded = 1e-6;

/// What about the points deserves a warning, a sentence each; mostly nothing. "Usual" is the median of
/// nearest_distances(), which is what this costs, where supports differ in units of the support; points
/// without neighbours do not count.
///
/// - Pairs much closer than is usual. Weights that grow like 1/r or 1/r^2 (diffuse) are dominated by them,
///   and explicit time steps are limited.
/// - Coordinates so far from the origin that they have lost digits: they are rounded by eps |x|, which
///   moves points by the part eps |x| / dx of their distance. A first derivative is off by up to that part of
///   |grad u|, a Laplacian by that part of |grad u| / dx. What is computed from them does not lose more,
///   since only differences enter.
///
/// @param cloud    n points
/// @param near     their neighbours: the supports count
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if `near` belongs to another number of points or `threads` is out of range
std::vector<std::string> warnings(const Cloud& cloud, const Neighbours& near, int threads = 0);

/// What an operator's entries tell about each of its n rows. With q = 1 for gradients, 2 for Laplacians,
/// P = degree(scheme), K = max(P, q) + 2, and dx_i = volume_i^(1/d); of a gradient's axes the worst counts.
struct RowDiagnosis {
  /// n. Lambda_i = dx_i^q sum_j |a_ij| over the neighbours: 2 to 5 in a healthy row of a Laplacian of
  /// second order, up to 10 in 3D; 1e2 is suspect, 1e5 broken.
  Eigen::VectorXd amplification;
  /// n. Negative ones among the neighbours' weights, by number, 0 to 1; 0 without neighbours.
  Eigen::VectorXd negative_share;
  /// n x (K + 1), length^(k - q). Column k: how far the moments of degree k, sum_j a_ij r_ij ... r_ij, are
  /// from what the derivative asks for, the Frobenius norm of that tensor over k!. Promised conditions,
  /// k <= RowReport::degree, leave rounding. Column 0 is the row sum and what the rounding of u and of
  /// the product can add; column P + 1 is the leading error of a row that keeps its promises.
  Eigen::MatrixXd residuals;
  /// n x (K + 2), length^(k - q). Column k: sum_j |a_ij| r_ij^k / k!. In column P + 1, where promises are
  /// kept, the error per unit of the supremum over the support of |d^(P+1) u / ds^(P+1)|, s any direction.
  Eigen::MatrixXd remainders;
};

/// @param scheme  what `op` was assembled with; lowered rows are judged by what they still promise
/// @param cloud   n points
/// @param op      all n rows of `scheme` on `cloud`, as assemble() returned them
/// @throws InvalidInput  if sizes disagree
RowDiagnosis diagnose(const Scheme& scheme, const Cloud& cloud, const Operator& op);

/// A bound of the error at each point (n), by Taylor's theorem about the point: the least over
/// l = max(P, q) + 1 .. K + 1 of
///
///     |error_i| <= sum_(k < l) residuals(i, k) M_k + remainders(i, l) M_l
///
/// @param rows         as diagnose() returned them
/// @param derivatives  n x (K + 2), or 1 x (K + 2) for all points: M_0 .. M_(K+1), bounds of |D^k u|, the
///   Frobenius norm of the tensor of all derivatives of order k, on the lines to the point's
///   neighbours; |wave vector|^k for a wave
/// @throws InvalidInput  if it has another shape
Eigen::VectorXd error_bound(const RowDiagnosis& rows, const Eigen::MatrixXd& derivatives);

/// What a Laplacian's entries tell about the matrix.
struct MatrixSummary {
  bool symmetric = false;  ///< omega_i a_ij = omega_j a_ji
  bool dominant = false;   ///< |a_ii| >= sum_j |a_ij| in every row
  bool m_matrix = false;   ///< minus the matrix: no negative weight, and dominant
  int bandwidth = 0;       ///< largest |i - j| of an entry
  /// By Gershgorin no eigenvalue has a real part beyond these; 1/length^2.
  double leftmost = 0;
  double rightmost = 0;        ///< see leftmost
  Method solver = Method::Lu;  ///< for implicit steps: Cholesky where the matrix is symmetric
};
/// @param laplacian  n x n
/// @param volumes    n, those of the operator
MatrixSummary summarise(const SparseMatrix& laplacian, const Eigen::VectorXd& volumes);

/// The rows and columns of `points` (m x m), which ascend.
/// @throws InvalidInput  if they do not, or one is out of range
SparseMatrix principal_part(const SparseMatrix& A, const std::vector<int>& points);

/// Growth below this part of the median |a_ii| counts as none. Where no condition holds at a boundary,
/// polynomials are undamped: a matrix exact to degree P has a Jordan block of up to P / 2 + 1 rows at
/// zero, and rounding scatters its eigenvalues by up to 1e-4 of the largest. Smooth fields change as slowly.
inline constexpr double slow_growth = 1e-3;

/// Whether solutions of du/dt = nu A u grow, told from a few rows.
struct Forecast {
  bool grows = false;    ///< by more than slow_growth
  bool certain = false;  ///< proved, by Gershgorin's theorem or by Cauchy's interlacing
  int point = -1;        ///< where growth is fastest, -1: nowhere
  double rate = 0;       ///< there, 1/length^2; <= 0 without growth
};

/// Growth starts locally: at the nine points whose Gershgorin discs reach furthest to the right, the
/// eigenvalues of the block of the 30 nearest points tell whether A has any with a positive real part.
/// @param cloud      n points
/// @param laplacian  n x n, of `cloud`'s points
/// @param points     those that evolve, ascending; the others are fixed
/// @param volumes    n, those of the operator
Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const Eigen::VectorXd& volumes);

/// Eigenvalues of a matrix, 1/length^2 for a Laplacian.
struct Spectrum {
  Eigen::VectorXcd values;  ///< all in no order, or the rightmost and the leftmost
  bool complete = true;     ///< whether these are all
  double zero = 0;          ///< what counts as zero, slow_growth times the median |a_ii|

  double rightmost() const;  ///< largest real part; 0 without eigenvalues
  double leftmost() const;   ///< smallest
  double widest() const;     ///< largest imaginary part
  /// Whether an eigenvalue is to the right of zero.
  bool grows() const { return rightmost() > zero; }
};

/// Up to `complete_below` rows all eigenvalues, by a dense method, O(n^3); else the rightmost and the
/// leftmost, by Arnoldi iteration, to 1e-7 of the distance between them.
/// @param A               n x n
/// @param volumes         n: a matrix that is symmetric after scaling by them is treated as such, which is
///   faster and more accurate; empty: not looked at
/// @param complete_below  the most rows of a matrix all of whose eigenvalues are wanted
/// @throws SolverError  if the iteration does not converge
Spectrum spectrum(const SparseMatrix& A, const Eigen::VectorXd& volumes = {},
                  int complete_below = 2000);

/// Explicit methods for du/dt = nu A u.
enum class Stepper { Euler, RungeKutta4 };

/// Largest dt nu (length^2) with which explicit steps of du/dt = nu A u keep every eigenvector from
/// growing: |1 + z| <= 1 or |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for z = dt nu lambda. 0 if one
/// grows at any step; infinity if all eigenvalues are zero.
double largest_stable_step(const Spectrum& spectrum, Stepper stepper);

/// dt nu (length^2, ascending) at which I - dt nu A is singular: 1 / lambda for each real eigenvalue
/// that is positive. Larger steps than the last of a complete spectrum meet none.
std::vector<double> singular_steps(const Spectrum& spectrum);

}  // namespace gradpsi
#pragma GCC visibility pop
