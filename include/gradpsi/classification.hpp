#pragma once

#include <string>
#include <string_view>
#include <vector>

#pragma GCC visibility push(default)
namespace gradpsi {

/// What a scheme approximates.
enum class Derivative {
  Gradient,   ///< d numbers
  Laplacian,  ///< one
  Hessian,    ///< the second derivatives, d(d+1)/2: xx, xy, yy; xx, xy, xz, yy, yz, zz
  Value       ///< u itself, of a fit to the values around
};

/// Which phi(r) weighs a neighbour (Tables I and II), with W the kernel and d the dimension.
enum class Weight {
  Direct,      ///< gradient -W'/r, Laplacian W'' + (d-1) W'/r
  Diffuse,     ///< gradient d W/r^2, Laplacian 2d W/r^2
  DiffuseNs,   ///< gradient W/r, Laplacian 2 W/r; without correction a power of length is missing
  Mixed,       ///< Laplacian -2 W'/r
  Kernel,      ///< W: the least-squares schemes of any degree; not part of their names
  Distance,    ///< no phi but a cost, (r/h)^5: the positive Laplacian; not part of its name
  Derivatives  ///< no phi: grad W and the second derivatives of W are the weights; not part of names
};

/// What a row promises, and how: see Scheme and degree().
enum class Consistency {
  Zoc,       ///< row sums are zero
  Foc,       ///< first order, gradients only
  Soc,       ///< second order
  SocLs,     ///< second order, not gradients: of all weights those of least sum psi^2 / (omega phi)
  Positive,  ///< second order, Laplacians only: no weight negative, least sum (r/h)^5 psi
  LeastSquares,  ///< exact on polynomials of a degree from 1 to 6; second derivatives from 2 on
  Symmetric,     ///< nothing, not even zero row sums: u_j + u_i takes the place of u_j - u_i
  Morris,        ///< zoc, phi damped near the point
  Normalized,    ///< each component's own linear function
  Fpm,           ///< first order, u_i fitted
  Mls,           ///< exact on polynomials of a degree up to 6, u_i fitted
  Msph,          ///< second order, u_i fitted
  Cspm,          ///< exact on linear functions
  Icspm,         ///< second order
  Rkpm,          ///< exact on polynomials of degree 1 or 2, shape functions differentiated in full
  Kgf,           ///< exact on linear functions: a gradient's gradient
  KgfImproved    ///< exact on linear functions
};

/// The order of the derivative: 1 for gradients, 2 for Laplacians and Hessians, 0 for values.
int order(Derivative derivative);

/// What the matrices of a derivative are called, in the order of Operator::axes: "x", "y", "z" as far as
/// there are dimensions for a gradient, one name that is empty for a Laplacian or a value, and "xx", "xy", "yy" and so on for a Hessian.
std::vector<std::string> components(Derivative derivative, int dimension);

std::string_view name(Derivative derivative);  ///< "gradient", "laplacian", "hessian", "value"
std::string_view name(Weight weight);          ///< "direct", "diffuse", ..., "kernel", "distance"
std::string_view name(
    Consistency consistency);  ///< "zoc", "foc", "soc", "soc-ls", "positive", "ls", ..

/// What holds for the off-diagonal entries scaled by the row's volume, given one support for all; for several
/// see with_symmetric_supports().
enum class Symmetry {
  None,
  Symmetric,     ///< omega_i a_ij = omega_j a_ji: zoc Laplacians and Hessians
  Antisymmetric  ///< omega_i a_ij = -omega_j a_ji: zoc gradients, of either sign of u_i
};
std::string_view name(Symmetry symmetry);  ///< "none", "symmetric", "antisymmetric"

}  // namespace gradpsi
#pragma GCC visibility pop
