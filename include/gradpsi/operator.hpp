#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// What happens to a degenerate row: one whose moment system is singular (fewer neighbours than
/// unknowns, neighbours on a line, circle or other quadric, reciprocal condition number below
/// `singular_below`), whose weights miss the scheme's conditions by the part `missed_above` because of
/// rounding, that has no positive stencil if it is to be one, that has no neighbour at all, or that
/// would hold a number that is not finite.
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

/// A row whose moments are off by more than this part of the derivative's own, or whose weights are so
/// large that the rounding of u alone, eps sum |a_ij|, comes to that, does not do what it promises.
inline constexpr double missed_above = 0.01;

/// OnDegenerate::Widen goes up to this many times the support (in periodic boxes half a box at most).
inline constexpr double widest = 3;

/// What was done with a row.
enum class RowOutcome : unsigned char { AsAsked, Lowered, Widened, Zero };
std::string_view name(RowOutcome outcome);  ///< "as-asked", "lowered", "widened", "zero"

/// How each assembled row came about; entry k belongs to row k of the matrices.
struct RowReport {
  IndexVector neighbours;  ///< in the support used, without the point itself
  DenseVector supports;    ///< used: that of the neighbours, or what it was widened to
  /// 1 / (|M| |M^-1|) in the 1-norm, 0 to 1, of the row's moment system M at the consistency asked for,
  /// in units of h: 0 if it has too few neighbours or broke down; 1 for zoc, which has no system, if
  /// there are neighbours; of a positive stencil's few equations.
  DenseVector reciprocal_condition;
  std::vector<RowOutcome> outcome;  ///< what was done
  IndexVector degree;  ///< of the polynomials that are differentiated exactly; -1 in a zero row
  /// Where each row has a scheme of its own, by assemble_to(): which (none in a zero row) ..
  std::vector<std::optional<Scheme>> schemes = {};
  DenseVector errors = {};  ///< .. and its certified_errors(); else both are empty

  int degenerate() const;  ///< rows whose outcome is not AsAsked
};

/// A derivative as sparse matrices, and how its rows came about.
struct Operator {
  std::vector<SparseMatrix> axes;  ///< one for each of components(): d/dx, d/dy, ..; d^2/dx^2, ..
  DenseVector volumes;  ///< of all n points, the cloud's or by number density; areas on a surface
  RowReport rows;       ///< how each row came about
  std::vector<int> points =
      {};  ///< whose rows these are, AssemblyOptions::rows; empty: all, in order
  /// Rows x 3, on a surface: its normal at each, of length 1 and of either sign, 0 where there is none;
  /// else empty.
  Positions normals = {};

  /// The point that a row is about.
  int point(int row) const { return points.empty() ? row : points[row]; }
  const SparseMatrix& matrix() const { return axes.front(); }  ///< the Laplacian, or d/dx
};

}  // namespace gradpsi
#pragma GCC visibility pop
