#pragma once

#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/operator.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Points of walls where transfer u + n . grad u = flux: a flux, or with transfer > 0 an exchange with what is at
/// flux / transfer.
struct FluxWalls {
  std::vector<int> points = {};  ///< 0-based, each once
  Positions normals = {};        ///< points x d: n, outward, not 0, of any length
  DenseVector flux = {};         ///< one per point; empty: 0
  DenseVector transfer = {};     ///< one per point, >= 0 (1/length if n has length 1); empty: 0
};

/// A Laplacian whose rows at walls know the slope there.
struct WithWalls {
  Operator
      laplacian;  ///< walls' rows are AsAsked or Lowered, those of walls that remain as they were
  DenseVector source;   ///< n: what the flux adds to lap u, 0 but at walls
  FluxWalls remaining;  ///< those that could not be taken up
};

/// Gives a Laplacian other rows at walls: instead of a row of its own for the condition such a point obeys
/// the equation, with
///
///     (lap u)_i = sum_j a_ij (u_j - u_i) + b_i (flux_i - transfer_i u_i) / |n_i|,    a_ij >= 0, b_i >= 0,
///
/// exact on polynomials of degree 2: the positive stencil (see Scheme) in which the slope takes part, so
/// that neighbours on one side will do. Rows without one meet sum_j a_ij r_ij + b_i n / |n| = 0 and
/// sum_j a_ij |r_ij|^2 = 2d only, and are Lowered. No such row lets u grow; what the transfer adds to the
/// diagonal makes it larger. At a corner all neighbours may lie to one side of the normal: that wall remains,
/// to be a condition of another kind. The others are none any more; on a surface the edges are such walls,
/// in the plane that touches it, and what of n points out of it does not count. Steps then have nu source among their sources (DiffusionOptions::source), after
/// with_conductivity() kappa_i nu source_i.
///
/// @param laplacian  as assembled, all rows or some, those of the walls among them
/// @param cloud      n points
/// @param near       their neighbours
/// @param walls      where, and what flux
/// @param threads    0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if sizes disagree, a number is out of range or not finite, a point is named twice
WithWalls with_walls(Operator laplacian, const Cloud& cloud, const Neighbours& near,
                     const FluxWalls& walls, int threads = 0);

}  // namespace gradpsi
#pragma GCC visibility pop
