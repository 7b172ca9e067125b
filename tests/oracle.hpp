#pragma once

#include <Eigen/Core>
#include <gradpsi/gradpsi.hpp>

namespace gradpsi {

struct OracleRow {
  Eigen::MatrixXd weights;      // matrices x n
  double reciprocal_condition;  // of the moment system in units of h, 1-norm; 1 for zoc
};

/// Row i of a scheme of at most second order, not positive, by the letter of its definition: in lengths, not scaled; in long double, with a
/// rank-revealing solver; every pair of points looked at, in a periodic box its nearest image.
OracleRow oracle_row(const Scheme& scheme, const Cloud& cloud, double h, int i,
                     const Kernel& kernel);

}  // namespace gradpsi
