#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace gradpsi {

/// Sets of numbers 0 to n - 1 that merge, each known by its lowest member.
class Sets {
 public:
  explicit Sets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

  int of(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void merge(int i, int j) {
    i = of(i), j = of(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace gradpsi
