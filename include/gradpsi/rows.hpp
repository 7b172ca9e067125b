#pragma once

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// What an operator's entries tell about each of its n rows. With q = 1 for gradients, 2 for Laplacians,
/// P = degree(scheme), K = max(P, q) + 2, and dx_i = volume_i^(1/d); of a gradient's axes the worst counts.
struct RowDiagnosis {
  /// n. Lambda_i = dx_i^q sum_j |a_ij| over the neighbours: 2 to 5 in a healthy row of a Laplacian of
  /// second order, up to 10 in 3D; 1e2 is suspect, 1e5 broken.
  DenseVector amplification;
  /// n. Negative ones among the neighbours' weights, by number, 0 to 1; 0 without neighbours.
  DenseVector negative_share;
  /// n x (K + 1), length^(k - q). Column k: how far the moments of degree k, sum_j a_ij r_ij ... r_ij, are
  /// from what the derivative asks for, the Frobenius norm of that tensor over k!. Promised conditions,
  /// k <= RowReport::degree, leave rounding. Column 0 is the row sum and what the rounding of u and of
  /// the product can add; column P + 1 is the leading error of a row that keeps its promises.
  DenseMatrix residuals;
  /// n x (K + 2), length^(k - q). Column k: sum_j |a_ij| r_ij^k / k!. In column P + 1, where promises are
  /// kept, the error per unit of the supremum over the support of |d^(P+1) u / ds^(P+1)|, s any direction.
  DenseMatrix remainders;
};

/// @param scheme  what `op` was assembled with; lowered rows are judged by what they still promise
/// @param cloud   n points
/// @param op      all n rows of `scheme` on `cloud`, as assemble() returned them
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if sizes disagree or `threads` is out of range
RowDiagnosis diagnose(const Scheme& scheme, const Cloud& cloud, const Operator& op,
                      int threads = 0);

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
DenseVector error_bound(const RowDiagnosis& rows, const MatrixView& derivatives);

}  // namespace gradpsi
#pragma GCC visibility pop
