#pragma once

#include <vector>

#include "gradpsi/operator.hpp"

namespace gradpsi {

/// Rows taken out of operators, one a point at most, until they are all there.
class RowStore {
 public:
  RowStore(int points, int outputs);

  /// Takes row k of `op`, which is by `scheme` and good to `error`, in the place of what was there for its point.
  void take(const Operator& op, int k, const Scheme& scheme, double error);
  /// Leaves point i without a row.
  void drop(int i);
  /// Of point i; infinity without a row.
  double error(int i) const { return rows_.errors[i]; }
  /// Rows that are not there are empty but for a 0 on the diagonal.
  Operator operator_of(const DenseVector& volumes) const;

  RowReport& report() { return rows_; }

 private:
  struct Place {
    std::size_t begin;
    int count;
  };
  void tidy();

  std::vector<Place> places_;
  std::size_t unused_ = 0;                   // of columns_: rows that others have replaced
  std::vector<int> columns_;                 // those of a row that is not there first, the diagonal
  std::vector<std::vector<double>> values_;  // by output
  RowReport rows_;
};

}  // namespace gradpsi
