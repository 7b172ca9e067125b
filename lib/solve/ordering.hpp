#pragma once

#include <Eigen/Core>

#include "gradpsi/cloud.hpp"
#include "gradpsi/matrix.hpp"
#include "solve/factor.hpp"
#include "solve/system.hpp"

namespace gradpsi {

/// A nested dissection of the graph of A (n x n, rows with their neighbours): the order in which
/// unknowns are eliminated, a permutation of 0 to n - 1.
///
/// The points are cut at the median of their box's longest side; those before the cut with a
/// neighbour behind it separate the halves and come last; then the same in each half. Graph
/// partitioners have to find by search what the coordinates tell at once. n log n.
Eigen::VectorXi dissection(const Positions& x, const SparseMatrix& A);

/// The order, as the system's options ask for it, in which a matrix of its unknowns is to be factorised.
Elimination elimination(const LinearSystem& system, const SparseMatrix& matrix);

}  // namespace gradpsi
