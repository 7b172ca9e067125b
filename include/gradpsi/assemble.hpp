#pragma once

#include <optional>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// How rows are computed, and which.
struct AssemblyOptions {
  Kernel kernel = kernels().front();                ///< W, of the neighbours' supports
  OnDegenerate on_degenerate = OnDegenerate::Fail;  ///< the policy for rows without a solution
  /// Assemble these rows only, in this order (0-based points). Unset: all rows.
  std::optional<std::vector<int>> rows = {};
  int threads = 0;  ///< 0: as many as OpenMP offers; the result does not depend on it
  /// Whether the points, which have three coordinates, lie on a surface, and derivatives are those within it:
  /// the gradient along the surface, its components in x, y and z, and the Laplace-Beltrami operator.
  /// Each row is the scheme's in two dimensions, of the neighbours' projections onto the plane that
  /// touches the surface at the point, by a polynomial of degree max(2, degree(scheme)) fitted to their
  /// heights. Volumes are areas. A row whose neighbours lie on no such surface is degenerate.
  /// Points of one or two coordinates are a line or a plane by themselves: nothing changes.
  bool on_surface = false;
};

/// The derivative operator of `scheme` on `cloud`.
///
/// Row i holds a_ij with (L u)_i = sum_j a_ij (u_j - u_i), G_ij or psi_ij of Scheme; the diagonal is
/// minus the sum of the others, so rows sum to zero: all but those of gradient-symmetric and of values,
/// whose rows sum to 1. Each matrix is n x n (options.rows: m x n),
/// compressed, columns ascending, with the pattern of `near` plus the diagonal; widened rows have
/// more entries, positive stencils only those that are not zero. Gradient entries are 1/length,
/// Laplacian entries 1/length^2.
///
/// Signs and symmetry: with one support, zoc Laplacians are symmetric after scaling by volume (see
/// symmetry(); with several by with_symmetric_supports()) and, but for direct, negative semi-definite. Corrected matrices are neither symmetric
/// nor definite, and near surfaces their diagonals may have either sign, but for positive stencils:
/// minus that matrix is an M-matrix.
///
/// Without volumes in the cloud, number_density_volumes() are used, on a surface number_density_areas().
/// Cost, with m = unknowns(scheme, d): O(m^2) per neighbour and O(m^3) per row.
///
/// @throws InvalidInput  if `scheme` is not one of schemes(), sizes disagree, a row or the number of
///   threads is out of range, a support is so large that 1/h or 1/h^2 is below a double, there would
///   be more than 2^31 - 1 entries, or a Hessian is asked for on a surface
/// @throws StencilError  for the first degenerate row (policy Fail), naming the point, its neighbour
///   count and the reciprocal condition number
Operator assemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                  const AssemblyOptions& options = {});

/// Several operators from one pass over the points, in the order of `schemes`; each as if assembled
/// alone, up to rounding. A gradient and a Laplacian by least squares of the same degree share their systems.
std::vector<Operator> assemble(const std::vector<Scheme>& schemes, const Cloud& cloud,
                               const Neighbours& near, const AssemblyOptions& options = {});

/// Puts new values in the place of those of `op`, which assemble() made with the same `near` and the
/// same options.rows: for points that have moved within one neighbour list, or another scheme for the
/// same derivative. No memory that grows with the cloud is allocated but for number_density_volumes().
///
/// @throws InvalidInput  as assemble(); if `op` has another pattern; if the pattern depends on the
///   values: laplacian-positive, or policy Widen
/// @throws StencilError  as assemble(); `op` then holds what could be computed
void reassemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near, Operator& op,
                const AssemblyOptions& options = {});

/// The same for several operators that share their pattern, in one pass over the points.
/// @throws InvalidInput  as above; if there are not as many operators as schemes
/// @throws StencilError  as above; all of `operators` then hold what could be computed
void reassemble(const std::vector<Scheme>& schemes, const Cloud& cloud, const Neighbours& near,
                std::vector<Operator>& operators, const AssemblyOptions& options = {});

/// Does for an operator that was assembled with OnDegenerate::Zero what OnDegenerate::Fail does, but for rows
/// that are not needed.
/// @param scheme  what `op` was assembled with
/// @param cloud   n points
/// @param op      as assemble() returned it
/// @param except  points whose rows may be degenerate, in any order
/// @throws StencilError  for the first degenerate row of another point, as assemble()
void require(const Scheme& scheme, const Cloud& cloud, const Operator& op, std::vector<int> except);

/// A zoc operator whose supports differ made symmetric after scaling by volume, or antisymmetric, as
/// symmetry() has it: j counts for i if it is in the support of either, with the mean of phi for both,
///
///     a_ij = omega_j (phi(r; h_i) + phi(r; h_j)) / 2     (gradients: times r_ij)
///
/// and rows sum to zero again. Supports need not be alike for it, but should vary slowly (local_spacing()):
/// what that costs is of the order of grad h, squared. Rows that are zero for want of an answer stay so, and
/// for their points other rows keep their own weights. `rows.neighbours` counts both kinds, as far as their
/// entries are not 0. With one support nothing changes but by rounding. Cost: a transposition of each matrix.
///
/// @param scheme   what `op` was assembled with
/// @param op       all n rows
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if symmetry(scheme) is None, if `op` has not all rows or not this scheme's number of
///   matrices, if `threads` is out of range, or if there would be more than 2^31 - 1 entries
Operator with_symmetric_supports(const Scheme& scheme, Operator op, int threads = 0);

/// Volumes by number density, V_i = 1 / sum_j W_ij, j = i included, with row i's support (n, length^d).
/// @param cloud    n points
/// @param near     their neighbours
/// @param kernel   W
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if `near` belongs to another number of points, `threads` is out of range, or a volume
///   is beyond a double
DenseVector number_density_volumes(const Cloud& cloud, const Neighbours& near,
                                   const Kernel& kernel = kernels().front(), int threads = 0);

/// Areas of points on a surface in three dimensions, in the same way by the kernel of two (n, length^2).
/// @throws InvalidInput  as above
DenseVector number_density_areas(const Cloud& cloud, const Neighbours& near,
                                 const Kernel& kernel = kernels().front(), int threads = 0);

}  // namespace gradpsi
#pragma GCC visibility pop
