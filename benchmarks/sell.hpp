#pragma once

#include <gradpsi/gradpsi.hpp>
#include <vector>

#include "kernels.hpp"

/// Sliced ELLPACK, SELL-8-512: rows in slices of 8, stored entry by entry across the slice and padded to
/// the longest; within each 512 rows those of equal length come together. Here to decide whether the
/// library should offer it.
class Sell {
 public:
  Sell(const gradpsi::SparseMatrix& A, int threads);

  /// y = A x
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y, int threads) const;

 private:
  static constexpr int lanes = SellArrays::lanes;
  void fill(const gradpsi::SparseMatrix& A, int slice);

  std::vector<int> row_;    // of each lane of each slice; -1 past the last
  std::vector<int> begin_;  // of each slice
  Eigen::VectorXi columns_;
  Eigen::VectorXd values_;
};
