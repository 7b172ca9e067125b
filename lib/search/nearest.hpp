#pragma once

#include "gradpsi/dense.hpp"
#include "search/tree.hpp"

namespace gradpsi {

/// nearest_distances() of the points of a tree.
template <int D>
DenseVector nearest_distances(const Tree<D>& tree, int threads);

/// kth_nearest_distances() of the points of a tree.
template <int D>
DenseVector kth_nearest_distances(const Tree<D>& tree, int k, int threads);

}  // namespace gradpsi
