#pragma once

#include "multigrid/hierarchy.hpp"

// See solve/for_petsc.hpp.
#pragma GCC visibility push(default)
namespace gradpsi {

DenseVector row_diffusivities(const SparseMatrix& A, const Cloud& points,
                              const std::vector<int>& diagonal, int threads);
Medium medium_of(const SparseMatrix& A, const DenseVector& volumes, DenseVector diffusivities,
                 const std::vector<char>& left_out, const OtherRows& others, int threads);
std::vector<CoarseLevel> coarser_levels(const Cloud& cloud, const Medium& medium,
                                        const std::vector<char>& left_out, double scale,
                                        int threads);

}  // namespace gradpsi
#pragma GCC visibility pop
