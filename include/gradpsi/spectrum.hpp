#pragma once

#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// What a Laplacian's entries tell about the matrix.
struct MatrixSummary {
  bool symmetric = false;  ///< omega_i a_ij = omega_j a_ji
  bool dominant = false;   ///< |a_ii| >= sum_j |a_ij| in every row
  bool m_matrix = false;   ///< minus the matrix: no negative weight, and dominant
  int bandwidth = 0;       ///< largest |i - j| of an entry
  /// By Gershgorin no eigenvalue has a real part beyond these; 1/length^2.
  double leftmost = 0;
  double rightmost = 0;  ///< see leftmost
};
/// @param laplacian  n x n
/// @param volumes    n, those of the operator
MatrixSummary summarise(const SparseMatrix& laplacian, const VectorView& volumes);

/// The rows and columns of `points` (m x m), which ascend.
/// @throws InvalidInput  if they do not, or one is out of range
SparseMatrix principal_part(const SparseMatrix& A, const std::vector<int>& points);

/// Growth below this part of the median |a_ii| counts as none. Where no condition holds at a boundary,
/// polynomials are undamped: a matrix exact to degree P has a Jordan block of up to P / 2 + 1 rows at
/// zero, and rounding scatters its eigenvalues by up to 1e-4 of the largest. Smooth fields change as slowly.
inline constexpr double slow_growth = 1e-3;

/// Whether solutions of du/dt = nu A u grow, told from a few rows.
struct Forecast {
  bool grows = false;  ///< by more than slow_growth
  bool certain =
      false;  ///< proved: by Gershgorin's theorem, by Cauchy's interlacing, or by all eigenvalues
  int point = -1;   ///< where growth is fastest, -1: nowhere
  double rate = 0;  ///< there, 1/length^2; without growth at most slow_growth, mostly < 0
};

/// Growth starts locally: at the nine points whose Gershgorin discs reach furthest to the right, and at the
/// eighteen whose discs do so in units of |a_ii|, the eigenvalues of the block of the 30 nearest points tell
/// where; those of blocks of 120 points, at the four points where it is fastest, whether A has any with a
/// positive real part. A block's rate falls short of the whole's a bit: half of slow_growth is growth, then.
/// @param cloud      n points
/// @param laplacian  n x n, of `cloud`'s points
/// @param points     those that evolve, ascending; the others are fixed
/// @param volumes    n, those of the operator
/// @throws InvalidInput  if sizes disagree or `points` do not ascend
/// @throws SolverError   if the eigenvalues of a block do not converge
Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const VectorView& volumes);

/// Eigenvalues of a matrix, 1/length^2 for a Laplacian.
struct Spectrum {
  ComplexVector values;  ///< all in no order, or the rightmost and the leftmost
  bool complete = true;  ///< whether these are all
  double zero = 0;       ///< what counts as zero, slow_growth times the median |a_ii|

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
/// @param threads         0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if sizes disagree or `threads` is out of range
/// @throws SolverError   if the iteration does not converge
Spectrum spectrum(const SparseMatrix& A, const DenseVector& volumes = {}, int complete_below = 2000,
                  int threads = 0);

/// Explicit methods for du/dt = nu A u.
enum class Stepper { Euler, RungeKutta4 };

/// What a step multiplies an eigenvector of A by, z = dt nu lambda: 1 + z or 1 + z + z^2/2 + z^3/6 + z^4/24.
std::complex<double> growth_factor(Stepper stepper, std::complex<double> z);

/// Largest dt nu (length^2) with which explicit steps of du/dt = nu A u keep every eigenvector from
/// growing, |growth_factor| <= 1. 0 if one grows at any step; infinity if all eigenvalues are zero.
double largest_stable_step(const Spectrum& spectrum, Stepper stepper);

/// dt nu (length^2, ascending) at which I - dt nu A is singular: 1 / lambda for each real eigenvalue
/// that is positive. Larger steps than the last of a complete spectrum meet none.
std::vector<double> singular_steps(const Spectrum& spectrum);

}  // namespace gradpsi
#pragma GCC visibility pop
