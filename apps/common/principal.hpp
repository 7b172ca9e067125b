#pragma once

#include <Eigen/Core>

namespace gradpsi::apps {

/// A symmetric matrix as V diag(values) V^T, values ascending.
struct PrincipalAxes {
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
PrincipalAxes principal_axes(const Eigen::MatrixXd& symmetric);

}  // namespace gradpsi::apps
