#pragma once

#include <Eigen/Core>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

// Rows may be some of a larger matrix's: `points` are those of the columns, with volumes, and `diagonal` says
// which of them each row belongs to.
namespace gradpsi {

/// What compact_twin() is to know of the columns, for each row; `walls` are rows.
DenseVector twin_scales(const SparseMatrix& A, const Cloud& points,
                        const std::vector<int>& diagonal, const std::vector<int>& walls,
                        int threads);

/// A sparser matrix that acts like A on smooth fields: A's row sums and row diffusivities, carried by
/// the mixed zoc weights of points within two spacings among A's neighbours; the rows of walls are
/// left to what their neighbours imply, no flux. diag(volumes) times it is symmetric (of one that is to be
/// factorised the upper triangle is read) and, unless A is singular or odd, positive definite.
/// @param scales  of the columns
void compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                  const VectorView& scales, int threads, SparseMatrix& twin);

}  // namespace gradpsi
