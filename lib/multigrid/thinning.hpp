#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// volume^(1/d) of each point.
DenseVector spacings(const Cloud& cloud);

/// How far, in spacings of a point, lists must reach for all that is made of them here; and for thinning and transfers
/// from three-dimensional points, where it halves the lists and costs at most an iteration.
constexpr double list_reach = 2.5, short_reach = 2;

/// A part of the points, about as even as all of them: none is nearer to another than 1.67 spacings in 2D (1.75 in
/// 3D), and every other point has one that near; a fourth to a ninth of the points. Distances are counted in
/// spacings' geometric means.
/// @param near      of n points, within short_reach spacings at least
/// @param left_out  n marks: those that cannot be kept
/// @return  0-based points in the order of near.order
std::vector<int> thin(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near,
                      const std::vector<char>& left_out);

}  // namespace gradpsi
