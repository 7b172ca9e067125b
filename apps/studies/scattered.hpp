#pragma once

#include <gradpsi/cloud.hpp>
#include <span>
#include <string_view>
#include <vector>

// Clouds that are no jittered squares: graded, random, with holes and corners.

namespace gradpsi::apps::scattered {

/// How the points of a cloud lie before it is given a shape.
enum class Points { Lattice, Hexagonal, Halton, Random };

/// What of the unit cube they fill.
enum class Shape { Whole, Annulus, L };

/// A kind of clouds.
struct Kind {
  std::string_view name;
  Points points;
  Shape shape = Shape::Whole;
  double grading = 0;  ///< x -> |x|^grading x: spacings grow with the distance from a corner
  bool uneven_supports = false;  ///< each point's is longer by up to a half, at random
  int least_dimension = 1, most_dimension = 3;

  /// Whether there is a periodic box of such points.
  bool can_be_periodic() const { return shape == Shape::Whole && grading == 0; }
};
std::span<const Kind> kinds();

/// One cloud.
struct Scene {
  Cloud cloud;
  std::vector<int> inner;  ///< points further than 0.7 spacings from the edge, ascending
  DenseVector stretch;     ///< n: what the support at each point is multiplied by
};

/// @param side  points of a lattice along a side of the cube
Scene scene(const Kind& kind, int dimension, int side, int seed, bool periodic);

}  // namespace gradpsi::apps::scattered
