#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"
#include "gradpsi/spmv.hpp"
#include "multigrid/medium.hpp"

namespace gradpsi {

/// The equations of some points by themselves, times their volumes: the masses on the diagonal, and differences
/// with points within two spacings by mixed zoc weights of which each point's own have exact second moments. An
/// M-matrix, symmetric: about 12 entries a row in 2D and 30 in 3D, the
/// diagonal first and the others ascending.
/// @param near   within list_reach spacings
/// @param left_out  n marks: points that others have no differences with
/// @param scale  > 0: of the result
SingleSparseMatrix compact_matrix(const Cloud& cloud, const DenseVector& spacings,
                                  const Neighbours& near, const Medium& medium,
                                  const std::vector<char>& left_out, double scale, int threads);

}  // namespace gradpsi
