#pragma once

#include <span>
#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// The neighbours of point i that are within its support, ascending: without a skin all of its list.
/// @param memory  holds them where the list has others, too
std::span<const int> within_support(const Cloud& cloud, const Neighbours& near, int i,
                                    std::vector<int>& memory);

}  // namespace gradpsi
