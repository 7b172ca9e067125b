#pragma once

#include <cstddef>
#include <vector>

#include "gradpsi/neighbours.hpp"
#include "search/search.hpp"

namespace gradpsi {

/// Lists of the nearest points, which grow as more of them are asked for: those of fewer points are parts of them.
class Nearby {
 public:
  /// @param count  as many nearest points as most rows will want
  /// @param most   and as many as any will
  Nearby(const Cloud& cloud, int count, int most, int threads);

  /// Neighbours of `points`, `count` of them at least where there are as many, within beyond_last times the
  /// distance to the last; those of other points are empty.
  /// @param points  ascending
  Neighbours nearest(const std::vector<int>& points, int count);

  /// All points, near ones close to one another, as Neighbours::order has them.
  const IndexVector& order() const { return order_; }

 private:
  struct List {
    std::size_t begin;
    int count;
  };

  void keep(const std::vector<int>& points, const Neighbours& near);
  void reach(const std::vector<int>& points, int count);
  double support(int i, int count, std::vector<double>& memory) const;

  const Cloud& cloud_;
  int most_, threads_;
  DenseVector supports_;     // how far lists reach
  std::vector<List> lists_;  // by point
  std::vector<int> indices_;
  std::vector<double> squared_;  // distances to these
  IndexVector order_;
  Surroundings around_;  // for a few points; built when it is first wanted
};

}  // namespace gradpsi
