#pragma once

#include <Eigen/Core>
#include <functional>

#include "solve/system.hpp"

namespace gradpsi {

/// Right-hand sides and what becomes of them, a column each. The memory stays from solve to solve.
struct Columns {
  /// Takes b and starts x in, in units of residual.hpp.
  void take(const Eigen::Ref<const Eigen::MatrixXd>& b, const Eigen::Ref<const Eigen::MatrixXd>& x);
  void give(Eigen::Ref<Eigen::MatrixXd> x) const;
  int count() const { return static_cast<int>(rhs.cols()); }

  Eigen::MatrixXd rhs, solution, residuals, corrections;
  Eigen::VectorXi units;  // powers of 2
};

/// Solves by `approximate`, to = A^-1 from for all columns, then refines up to twice. Whether that made solutions.
bool refine(
    const LinearSystem& system, Columns& columns, SolveReport& result,
    const std::function<void(const Eigen::MatrixXd& from, Eigen::MatrixXd& to)>& approximate);

/// Improves each column by `iterate`, again from the true residual as long as that halves it. Whether that
/// made solutions of them all.
/// @param at_a_time  after so many iterations the true residual is looked at, and has to be halved
/// @param iterate  starts from x, ends at a residual of 2-norm `target` or after `limit` iterations; gives
///   their number. It may take constants from b, of which `target` remembers the size
bool iterate_each(
    const LinearSystem& system, Columns& columns, int most_iterations, int at_a_time,
    SolveReport& result,
    const std::function<int(double* b, double* x, double target, int limit)>& iterate);

}  // namespace gradpsi
