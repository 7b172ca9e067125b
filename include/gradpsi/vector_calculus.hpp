#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/operator.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

// Functions of derivatives that are assembled already, by whatever scheme: they are as exact as it is. With
// G_a the matrices of a gradient and H_ab those of a Hessian, vectors v at n points in d dimensions are
// n x d, a component a column.
//
// What else there is needs no function of its own. The Laplacian of vectors is that of each component,
// multiply(laplacian.matrix(), v, Y); div(kappa grad u) is with_conductivity() in diffusion.hpp; and two
// passes of a gradient are products of block matrices, which with all rows can be multiplied:
//
//     grad div  = block_matrix(Gradient, G) * block_matrix(Divergence, G)
//     laplacian = block_matrix(Divergence, G) * block_matrix(Gradient, G)

/// Derivatives of vectors, each one sum over products G_a v_b or H_ab v_c.
enum class VectorOperator {
  Gradient,          ///< d u/dx_a of a scalar u, from G; d numbers
  Divergence,        ///< sum_a d v_a/dx_a, from G; one number
  Curl,              ///< from G in 2D d v_y/dx - d v_x/dy, one number; in 3D a vector
  VelocityGradient,  ///< d v_a/dx_b, from G; d^2 numbers: xx, xy, yx, yy with a before b
  Strain,            ///< (d v_a/dx_b + d v_b/dx_a)/2, from G; d(d+1)/2 numbers: xx, xy, yy
  GradDiv            ///< sum_b d^2 v_b/dx_a dx_b, from H; a vector
};

/// All of them, in this order.
std::span<const VectorOperator> vector_operators();

std::string_view name(VectorOperator what);  ///< "gradient", "divergence", ..., "grad-div"

/// What its numbers are called: one name that is empty for a scalar, "x", "y", "z" as far as there are
/// dimensions for a vector, "xx", "xy" and so on for what has two directions; none if there is no such
/// operator, the curl in 1D.
std::vector<std::string> components(VectorOperator what, int dimension);

/// Its value, from one reading of the matrices and one of their pattern: the numbers of components(), a
/// column each (rows x components).
///
/// That is block_matrix() times v to rounding, without the memory of it. Bitwise the same with any number of
/// threads; nothing is allocated once Y has its size.
/// @param what     the operator
/// @param parts    d matrices of a gradient, or d(d+1)/2 of a Hessian in the order of Operator::axes
/// @param v        n x d; of a scalar n x 1
/// @param Y        rows x components, filled
/// @param threads  0: as many as OpenMP offers
/// @throws InvalidInput  if there are too many or too few matrices or components, if there is no such
///   operator in d dimensions, or as multiply() in spmv.hpp
void multiply(VectorOperator what, std::span<const SparseMatrix> parts, const MatrixView& v,
              Result<Eigen::Dynamic> Y, int threads = 0);

/// The operator as one sparse matrix of blocks.
///
/// Vectors at n points are one vector of d n numbers, all of the first component first, and so is the
/// result: what n x d numbers are in memory, so that Y.reshaped() = block_matrix() * v.reshaped(), and each
/// block is a matrix that there is, times 1, -1 or 1/2. A point's components are n apart.
/// @param what     the operator
/// @param parts    as above
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @return  (rows times components()) x (n d), of a scalar x n; compressed, columns ascending
/// @throws InvalidInput  as above, or if there would be more than 2^31 - 1 rows, columns or entries
SparseMatrix block_matrix(VectorOperator what, std::span<const SparseMatrix> parts,
                          int threads = 0);

/// div(mu (grad v + grad v^T)), the force of viscous stresses in a fluid whose viscosity mu varies, as a
/// block matrix: block (a, b) times v_b is, summed over b, component a of
///
///     sum_b d_b(mu d_b v_a) + d_b(mu d_a v_b),
///     d_a(mu d_b w) = (mu H_ab w + H_ab(mu w) - w H_ab mu)/2 + (G_a mu G_b w - G_b mu G_a w)/2
///
/// Rows sum to zero. Exact where H is exact on mu v, and G on mu and v. With a constant mu it is mu times the
/// Laplacian of v and grad div v.
/// @param hessian   d(d+1)/2 matrices
/// @param gradient  d matrices of the same rows and the same pattern
/// @param mu        n numbers >= 0
/// @param threads   0: as many as OpenMP offers; the result does not depend on it
/// @return  (rows d) x (n d), blocks as those of block_matrix()
/// @throws InvalidInput  if sizes or patterns disagree, if a mu is out of range (names the point), or as
///   block_matrix()
SparseMatrix viscous_force(const Operator& hessian, const Operator& gradient, const VectorView& mu,
                           int threads = 0);

/// The gradient that conserves momentum as the divergence by `gradient` conserves mass:
///
///     G+_a = -Omega^-1 G_a^T Omega, Omega the volumes on a diagonal
///
/// With <a, b> = sum_i omega_i a_i b_i it is the negative adjoint of the divergence,
/// <v, G+ p> = -<div v, p>: what a pressure does to the kinetic energy is what the volume's change does
/// to the pressure's. Where rows of G sum to zero, momentum is conserved, sum_i omega_i (G+ p)_i = 0 for any
/// p, to rounding; div G+ is symmetric after scaling by volume and negative semi-definite.
///
/// It is a force and no approximation of grad p: of p = 1 it makes a multiple of 1/h where supports are cut
/// off. Rows follow from those of the neighbours: one that is zero or lowered in G changes theirs.
///
/// @param gradient  all n rows
/// @param threads   0: as many as OpenMP offers; the result does not depend on it
/// @return  d matrices n x n of one pattern, that of G transposed; as `parts` above
/// @throws InvalidInput  if rows are missing, or the matrices do not share their pattern
std::vector<SparseMatrix> conservative_companion(const Operator& gradient, int threads = 0);

}  // namespace gradpsi
#pragma GCC visibility pop
