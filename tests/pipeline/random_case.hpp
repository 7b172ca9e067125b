#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "clouds.hpp"

namespace gradpsi {

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(generator_() >> 11), -53);
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  int below(int n) { return static_cast<int>(generator_() % static_cast<unsigned>(n)); }
  bool chance(double share) { return between(0, 1) < share; }
  std::vector<int> permutation(int n) {
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::ranges::shuffle(order, generator_);
    return order;
  }

 private:
  std::mt19937_64 generator_;
};

/// Points, supports, a scheme and options, and what they are called.
struct RandomCase {
  std::string description;
  Scheme scheme;
  AssemblyOptions options;
  Cloud cloud;
  Eigen::VectorXd supports;
  double translation;  // without rounding
  double unit;         // of length, a power of two
  bool ordinary_unit;

  int size() const { return cloud.size(); }
  int dimension() const { return cloud.dimension(); }
  bool positive() const { return scheme.consistency == Consistency::Positive; }
  /// Entries are 1 / length to this power.
  int power() const {
    // diffuse-ns without correction lacks one power of length: the paper's scheme, kept literally.
    const bool lacks = scheme.weight == Weight::DiffuseNs && scheme.consistency == Consistency::Zoc;
    return order(scheme.derivative) - (lacks ? 1 : 0);
  }
  CloudOptions cloud_options() const { return {.volumes = cloud.volumes(), .box = cloud.box()}; }
  Operator assembled(const Cloud& points, const Eigen::VectorXd& h) const {
    return assemble(scheme, points, find_neighbours(points, h), options);
  }
  /// r_ij / h_i.
  Eigen::VectorXd displacement(int i, int j, double h) const {
    Eigen::VectorXd r = cloud.positions().row(j) - cloud.positions().row(i);
    for (int a = 0; a < dimension(); ++a)
      if (cloud.box()[a] > 0) r[a] = std::remainder(r[a], cloud.box()[a]);
    return r / h;
  }
};

/// A case of that seed, in d dimensions. Large clouds are for several threads, with schemes that are quickly computed.
RandomCase with_seed(std::uint64_t seed, int d, bool large = false);

}  // namespace gradpsi
