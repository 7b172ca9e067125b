#pragma once

#include <gradpsi/cloud.hpp>
#include <gradpsi/neighbours.hpp>
#include <optional>
#include <string>

// Spacings that differ by direction.

namespace gradpsi::apps {

/// Points that are closer along one direction than along another, the same everywhere.
struct Anisotropy {
  double ratio;               ///< of the largest spacing to the least, about
  Eigen::VectorXd direction;  ///< of the least: d numbers, a unit vector
  double largest;             ///< spacing, a length
};

/// How spacings differ by direction; nothing unless by a factor of 3 to 1000 (beyond, points are on a line or
/// surface). Asks a sample of the points for their nearest ones; if those lie mostly along one direction, stretches
/// it until they do not, which takes a few searches among all points.
std::optional<Anisotropy> anisotropy(const Cloud& cloud, const Neighbours& near, int threads);

/// "spacings differ by direction: .."
std::string words(const Anisotropy& found, const std::string& axes);

}  // namespace gradpsi::apps
