#pragma once

#include <Eigen/SparseCore>
#include <optional>
#include <string_view>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Rows compressed, columns ascending, indices of 32 bits.
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;

/// What happens to a degenerate row: one whose moment system is singular (fewer neighbours than
/// unknowns, neighbours on a line, circle or other quadric, reciprocal condition number below
/// `singular_below`), that has no positive stencil if it is to be one, that has no neighbour at all, or
/// that would hold a number that is not finite.
enum class OnDegenerate {
  Fail,   ///< throw StencilError
  Lower,  ///< use the next lower consistency that can be solved; at last, zero
  Widen,  ///< enlarge the support by a fifth until the row can be solved; beyond `widest`, zero
  Zero    ///< leave the row zero
};

/// A moment system with a smaller reciprocal condition number (1-norm, scaled by h) counts as
/// singular: less than two digits of its solution would be right. The systems of least squares are
/// judged after scaling their diagonal to 1, which takes the degree out of the condition.
inline constexpr double singular_below = 1e-14;

/// OnDegenerate::Widen goes up to this many times the support (in periodic boxes half a box at most).
inline constexpr double widest = 3;

/// How rows are computed, and which.
struct AssemblyOptions {
  Kernel kernel = kernels().front();                ///< W, of the neighbours' supports
  OnDegenerate on_degenerate = OnDegenerate::Fail;  ///< the policy for rows without a solution
  /// Assemble these rows only, in this order (0-based points). Unset: all rows.
  std::optional<std::vector<int>> rows = {};
  int threads = 0;  ///< 0: as many as OpenMP offers; the result does not depend on it
};

/// What was done with a row.
enum class RowOutcome : unsigned char { AsAsked, Lowered, Widened, Zero };
std::string_view name(RowOutcome outcome);  ///< "as-asked", "lowered", "widened", "zero"

/// How each assembled row came about; entry k belongs to row k of the matrices.
struct RowReport {
  Eigen::VectorXi neighbours;  ///< in the support used, without the point itself
  Eigen::VectorXd supports;    ///< used: that of the neighbours, or what it was widened to
  /// 1 / (|M| |M^-1|) in the 1-norm, 0 to 1, of the row's moment system M at the consistency asked for,
  /// in units of h: 0 if it has too few neighbours or broke down; 1 for zoc, which has no system, if
  /// there are neighbours; of a positive stencil's few equations.
  Eigen::VectorXd reciprocal_condition;
  std::vector<RowOutcome> outcome;  ///< what was done
  Eigen::VectorXi degree;  ///< of the polynomials that are differentiated exactly; -1 in a zero row

  int degenerate() const;  ///< rows whose outcome is not AsAsked
};

/// A derivative as sparse matrices, and how its rows came about.
struct Operator {
  std::vector<SparseMatrix> axes;  ///< gradient: d/dx, d/dy, d/dz (d of them); Laplacian: one
  Eigen::VectorXd volumes;         ///< of all n points, the cloud's or by number density
  RowReport rows;                  ///< how each row came about
  std::vector<int> points =
      {};  ///< whose rows these are, AssemblyOptions::rows; empty: all, in order

  const SparseMatrix& matrix() const { return axes.front(); }  ///< the Laplacian, or d/dx
};

/// The derivative operator of `scheme` on `cloud`.
///
/// Row i holds a_ij with (L u)_i = sum_j a_ij (u_j - u_i), G_ij or psi_ij of Scheme; the diagonal is
/// minus the sum of the others, so rows sum to zero. Each matrix is n x n (options.rows: m x n),
/// compressed, columns ascending, with the pattern of `near` plus the diagonal; widened rows have
/// more entries, positive stencils only those that are not zero. Gradient entries are 1/length,
/// Laplacian entries 1/length^2.
///
/// Signs and symmetry: with one support, zoc Laplacians are symmetric after scaling by volume (see
/// symmetry()) and, but for direct, negative semi-definite. Corrected matrices are neither symmetric
/// nor definite, and near surfaces their diagonals may have either sign, but for positive stencils:
/// minus that matrix is an M-matrix.
///
/// Without volumes in the cloud, number_density_volumes() are used.
/// Cost, with m = unknowns(scheme, d): O(m^2) per neighbour and O(m^3) per row.
///
/// @throws InvalidInput  if `scheme` is not one of schemes(), sizes disagree, a row or the number of
///   threads is out of range, a support is so large that 1/h or 1/h^2 is below a double, or there would
///   be more than 2^31 - 1 entries
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

}  // namespace gradpsi
#pragma GCC visibility pop
