#pragma once

#include <vector>

#include "gradpsi/assemble.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// A bound of what each row makes of waves, proved:
///
///     |sum_j a_ij e^(i k . r_ij) - symbol(k)| / (2 pi / L_i)^q <= error_i   for all |k| <= 2 pi / L_i
///
/// with the symbol -|k|^2 of a Laplacian, i k of a gradient, -k_a k_b of a Hessian, 1 of a value, q the order of
/// the derivative, and |.| over its components. So it is relative to the derivative of the shortest wave.
///
/// Behind it is Taylor's series at the point: moments degree by degree, each at its worst direction, until what
/// is left out no longer matters. Even degrees are the real part and odd ones the imaginary. The worst direction
/// is found from some: a polynomial of degree m on the sphere whose largest magnitude is 1 is cos(m delta) at
/// least at a distance delta of where it is (M. Riesz).
///
/// @param derivative   of the rows
/// @param cloud        n points
/// @param op           some rows on these points, as assemble() returned them, not on a surface
/// @param wavelengths  L, lengths > 0: one, or n
/// @param threads      0: as many as OpenMP offers; the result does not depend on it
/// @return  one for each row of `op`; infinity for rows that were left zero
/// @throws InvalidInput  if sizes disagree, a wavelength or `threads` is out of range, or 1 / L^q is beyond a double
DenseVector certified_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                             const VectorView& wavelengths, int threads = 0);

/// What every row is to be good for.
struct Accuracy {
  double tolerance;         ///< the largest certified_errors() allowed, > 0
  DenseVector wavelengths;  ///< L of the shortest wave that matters: one for all points, or n
};

/// How rows are chosen.
struct ToleranceOptions {
  Kernel kernel = kernels().front();  ///< W, of each row's support
  /// What happens to a row that no candidate is good enough for: Fail throws; Lower keeps the best there is;
  /// Zero leaves it zero. Widen is none of these.
  OnDegenerate on_miss = OnDegenerate::Fail;
  /// Of a Laplacian: whether du/dt = nu A u is to have no solution that grows, as far as forecast() can tell; rows
  /// must have points on all sides, and fixed points, if there are any, be reached from all others by way of the rows.
  /// Positive stencils look further for points then. Where something is wrong all the same, rows are exchanged for
  /// those that are good enough and whose Gershgorin discs reach least far to the right.
  bool stable = false;
  std::vector<int> fixed =
      {};  ///< points whose values do not evolve, ascending: their rows may miss the tolerance
  int threads = 0;  ///< 0: as many as OpenMP offers; the result does not depend on it
};

/// A derivative each of whose rows is by the cheapest scheme and support that are good enough there, or nearly: of
/// many points most first try what some others ended with, which takes up to a tenth more entries. Candidates
/// are least squares of degree 1 to 6, and minimal positive stencils, on each point's nearest neighbours, from as
/// few as can be up to 2.4 times the unknowns; rows without answer at one try the next.
///
/// RowReport::schemes, supports and errors say which, and how good; rows that miss the tolerance and are kept are
/// Lowered. Kernels' weights take volumes from the cloud, or by number density.
///
/// @param wanted      the tolerance, and for which waves
/// @param derivative  a gradient, Laplacian or Hessian
/// @param cloud       n points
/// @param options     how
/// @throws InvalidInput  if a number is out of range or sizes disagree; if `derivative` is that of a value; if
///   `stable` is asked of what is no Laplacian, or `fixed` does not ascend
/// @throws StencilError  for the first row that misses the tolerance (Fail), naming the point, the error that its
///   best row has, and the tolerance that all rows meet
/// @throws SolverError   if no such exchange helps (`stable`), naming a point
Operator assemble_to(const Accuracy& wanted, Derivative derivative, const Cloud& cloud,
                     const ToleranceOptions& options = {});

}  // namespace gradpsi
#pragma GCC visibility pop
