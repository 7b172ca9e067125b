#pragma once

#include <cmath>
#include <limits>
#include <random>

#include "clouds.hpp"
#include "dense.hpp"

namespace gradpsi {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// I - c Psi on an irregular cloud, c in spacings squared.
struct System {
  explicit System(const Scheme& scheme, int dimension = 2, int side = 12, double c = 5)
      : System(scheme, irregular_cloud(dimension, side), c) {}
  System(const Scheme& scheme, Cloud points_of, double c) : cloud(std::move(points_of)) {
    const Neighbours near = find_neighbours(cloud, rich_support(cloud));
    const Operator op = assemble(scheme, cloud, near);
    SparseMatrix identity(cloud.size(), cloud.size());
    identity.setIdentity();
    matrix = identity - c * std::pow(cloud.spacing(), 2) * op.matrix();
    matrix.makeCompressed();
    points = {cloud};
  }
  Eigen::MatrixXd right_hand_sides(int count) const {
    std::mt19937_64 generator(7);
    std::uniform_real_distribution<double> value(-1, 1);
    return Eigen::MatrixXd::NullaryExpr(matrix.rows(), count, [&] { return value(generator); });
  }
  Eigen::MatrixXd dense_solution(const Eigen::MatrixXd& b) const {
    return gradpsi::dense_solution(matrix, b);
  }

  Cloud cloud;
  SparseMatrix matrix;
  SystemPoints points;
};

}  // namespace gradpsi
