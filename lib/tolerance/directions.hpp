#pragma once

#include <Eigen/Core>

namespace gradpsi {

/// Some directions, half of the sphere's, since waves along k and -k are conjugate: none is further than `apart`
/// from one of these or its opposite.
struct Directions {
  Eigen::MatrixXd axes;  // count x d, of length 1
  double apart;          // an angle
};
const Directions& directions(int dimension);

}  // namespace gradpsi
