#pragma once

#include <Eigen/Core>
#include <vector>

#include "gradpsi/assemble.hpp"
#include "gradpsi/cloud.hpp"

namespace gradpsi {

/// m_i = -sum_j a_ij r_ij^2 / (2d): the diffusivity (times the time step, or not) with which row i of
/// A = I - dt nu Psi diffuses; exact for rows of second-order consistency.
Eigen::VectorXd row_diffusivities(const SparseMatrix& A, const Cloud& points, int threads);

/// A sparser matrix that acts like A on smooth fields: A's row sums and row diffusivities, carried by
/// the mixed zoc weights of points within two spacings among A's neighbours; the rows of `walls` are
/// left to what their neighbours imply, no flux. diag(volumes) times it is symmetric (its upper
/// triangle is to be read) and, unless A is singular or odd, positive definite.
SparseMatrix compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& walls,
                          int threads);

}  // namespace gradpsi
