#pragma once

#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/scheme.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// How values between the points are computed.
struct InterpolationOptions {
  Kernel kernel = kernels().front();  ///< W, of the probes' supports
  int threads = 0;  ///< 0: as many as OpenMP offers; the result does not depend on it
};

/// Values and derivatives at probes, which need not be points of the cloud: probes of a flow, lines of a plot, the
/// points of another cloud. The weights are those of the fit around a point, less the point itself: moving
/// least squares, exact on polynomials of the scheme's degree; value-mls-0 is Shepard's. A probe at a point has that
/// point among its neighbours; values are fitted, so that what comes there is not the point's own.
///
/// Each matrix is m x n, compressed, columns ascending, with the points within the support of each probe.
/// A probe's support is that of the point nearest to it. Without supports it is a tenth more than the distance of
/// the (3 (m + 1))-th nearest point, m the scheme's unknowns, at least d; where those points do not determine the
/// fit, of twice, four or eight times as many. Rows of values sum to 1, those of derivatives to 0, up to rounding.
/// Operator::volumes are the cloud's, or by number density; all else is of the m probes.
///
/// Cost: one pass over the cloud, and for each probe a search and the scheme's system. Volumes by number density
/// take the neighbours of all points.
///
/// @param scheme    one that fits u at the point, too: value-mls-P, gradient-mls-P, laplacian-mls-P, hessian-mls-P
/// @param cloud     n points
/// @param probes    m x d; with a periodic box, probes outside it stand for their image
/// @param supports  n lengths > 0, or one for all, as find_neighbours() takes them; empty: as needed
/// @param options   kernel and threads
/// @throws InvalidInput  if the scheme is another one; if a size, a number or a support is out of range; for
///   probes outside the cloud, naming them with their distance: farther from all points than half the support,
///   without supports if that is also more than their nearest point is from its (3 (d + 1))-th nearest
/// @throws StencilError  for the first probe whose row cannot be computed: a larger support has more neighbours
Operator interpolate(const Scheme& scheme, const Cloud& cloud, const Positions& probes,
                     const VectorView& supports = DenseVector(),
                     const InterpolationOptions& options = {});

/// Several from one pass, in the order of `schemes`: those of a degree share their systems. Without supports they
/// are what the one with the most unknowns needs.
std::vector<Operator> interpolate(const std::vector<Scheme>& schemes, const Cloud& cloud,
                                  const Positions& probes,
                                  const VectorView& supports = DenseVector(),
                                  const InterpolationOptions& options = {});

/// Brings densities from the probes to the points, conserving their sum: with V the values at the probes,
/// R = Omega^-1 V^T Omega_probes (n x m), so that sum_i omega_i (R u)_i = sum_k omega_k u_k for any u. It is the
/// adjoint of V in the scalar products of the volumes; constants are kept as far as the probes' volumes fill the
/// points'.
/// @param value          of a value-... scheme, as interpolate() returned it
/// @param probe_volumes  m volumes > 0 (length^d)
/// @throws InvalidInput  if sizes disagree, a volume is not > 0 and finite, or the operator's rows are not of values
SparseMatrix conservative_transfer(const Operator& value, const VectorView& probe_volumes);

}  // namespace gradpsi
#pragma GCC visibility pop
