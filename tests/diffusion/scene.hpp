#pragma once

#include <limits>
#include <random>
#include <vector>

#include "clouds.hpp"

namespace gradpsi {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A cloud with operators and sides: the points within a spacing of x = 0 and those of x = 1.
struct Scene {
  explicit Scene(const std::string& scheme, int dimension = 2, int side = 10)
      : cloud(irregular_cloud(dimension, side)),
        near(find_neighbours(cloud, rich_support(cloud))),
        laplacian(assemble(scheme, cloud, near)) {
    for (int i = 0; i < cloud.size(); ++i) {
      const double x = cloud.positions()(i, 0);
      if (x < cloud.spacing()) left.push_back(i);
      if (x > 1 - cloud.spacing()) right.push_back(i);
    }
  }
  int size() const { return cloud.size(); }
  Eigen::VectorXd x() const { return cloud.positions().col(0); }
  Eigen::VectorXd field(unsigned seed = 3) const {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> value(-1, 1);
    return Eigen::VectorXd::NullaryExpr(size(), [&] { return value(generator); });
  }
  /// n . grad u + transfer u = flux on the right, n along x.
  WallConditions wall(double flux = 0, double transfer = 0) const {
    const auto count = static_cast<Eigen::Index>(right.size());
    WallConditions walls{.points = right, .normals = Positions::Zero(count, cloud.dimension())};
    walls.normals.col(0).setOnes();
    walls.gradient = assemble("gradient-direct-soc", cloud, near, {.rows = right}).axes;
    walls.flux = Eigen::VectorXd::Constant(count, flux);
    walls.transfer = Eigen::VectorXd::Constant(count, transfer);
    return walls;
  }

  Cloud cloud;
  Neighbours near;
  Operator laplacian;
  std::vector<int> left, right;
};

}  // namespace gradpsi
