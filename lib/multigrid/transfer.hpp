#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"
#include "gradpsi/spmv.hpp"
#include "multigrid/medium.hpp"

namespace gradpsi {

/// Values at all points from those at some.
struct Transfer {
  SingleSparseMatrix
      interpolation;  // n x m, rows sum to 1; near 1e-3 of a linear function's where a medium is even
  SingleSparseMatrix restriction;  // its transpose
  DenseVector volumes;             // m, > 0: what the points' add up to
  Medium medium;                   // of the m points
};

/// Between points and those of them that were kept by thin(). Points that are left out have no part.
/// @param near  of the n points, within `reach` spacings: list_reach or short_reach
Transfer transfer(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near,
                  double reach, const std::vector<int>& kept, const std::vector<char>& left_out,
                  const Medium& medium, int threads);

}  // namespace gradpsi
