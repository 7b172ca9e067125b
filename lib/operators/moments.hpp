#pragma once

#include <Eigen/Core>

#include "operators/basis.hpp"

namespace gradpsi {

/// The inverse of a moment matrix.
struct Inverse {
  Eigen::MatrixXd matrix;
  double reciprocal_condition;  // 1-norm, 0 to 1; 0 if singular, and the matrix is of no use
};

/// Of a symmetric positive definite matrix, unless it is singular. Solutions are columns of the inverse or
/// sums of them, and its norm gives the condition number exactly, so that one elimination serves both.
Inverse invert_definite(const Eigen::MatrixXd& A);

/// Of any matrix.
Inverse invert_general(const Eigen::MatrixXd& A);

/// The largest column sum of magnitudes.
double one_norm(const Eigen::MatrixXd& A);

/// sum_j weight_j p_k(j) t_l(j) for each column k of p and l of t; with the same columns for both only
/// half of it is summed up. `weighted` is memory for weight times p.
Eigen::MatrixXd moments(const Columns& weight, const Columns& p, const Columns& t,
                        Columns weighted);

}  // namespace gradpsi
