#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "solve/lu.hpp"
#include "solve/system.hpp"

namespace gradpsi {

/// Neither the diagonal nor a compact operator knows anything of boundary conditions, or of rows whose diagonal is
/// weak, and a preconditioner that gets these wrong costs hundreds of iterations: such rows are factorised among
/// themselves and correct what another preconditioner has done.
class RowCorrection {
 public:
  /// Without effect where there are no such rows or they are singular.
  /// @param rows  each once
  void prepare(const LinearSystem& system, std::vector<int> rows);

  /// Whether it has an effect.
  explicit operator bool() const { return factor_.has_value(); }
  double bytes() const { return factor_ ? factor_->report().bytes : 0; }

  /// Makes z meet the rows' equations, given the residuals r.
  void correct(const LinearSystem& system, const double* r, double* z);

 private:
  std::vector<int> rows_;
  SparseMatrix among_;  // the block of these
  std::optional<Lu> factor_;
  Eigen::VectorXd residuals_, corrections_;  // of the rows
};

}  // namespace gradpsi
