#pragma once

#include <vector>

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// Lists of the nearest points, which grow as more of them are asked for: those of fewer points are parts of them.
class Nearby {
 public:
  /// @param count  as many nearest points as most rows will want
  Nearby(const Cloud& cloud, int count, int threads);

  /// Neighbours of `points`, `count` of them at least where there are as many, within beyond_last times the
  /// distance to the last; those of other points are empty.
  /// @param points  ascending
  Neighbours nearest(const std::vector<int>& points, int count);

 private:
  void find(const std::vector<int>& points);
  void reach(const std::vector<int>& points, int count);

  const Cloud& cloud_;
  int threads_;
  DenseVector supports_;  // how far lists reach
  Neighbours wide_;
  std::vector<double> squared_;  // distances, as wide_.indices has the points
};

}  // namespace gradpsi
