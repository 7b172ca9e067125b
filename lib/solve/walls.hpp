#pragma once

#include <Eigen/Core>
#include <optional>

#include "solve/lu.hpp"
#include "solve/system.hpp"

namespace gradpsi {

/// Neither the diagonal nor a twin knows anything of boundary conditions, and a preconditioner that gets
/// them wrong costs hundreds of iterations: their rows are factorised among themselves and correct what
/// another preconditioner has done.
class WallCorrection {
 public:
  /// Without effect where there are no walls or their rows are singular.
  void prepare(const LinearSystem& system);

  /// Makes z meet the boundary conditions, given the residuals r.
  void correct(const LinearSystem& system, const double* r, double* z);

 private:
  std::optional<Lu> factor_;
  Eigen::VectorXd residuals_, corrections_;  // of the walls' rows
};

}  // namespace gradpsi
