#pragma once

#include <gradpsi/diffusion.hpp>
#include <gradpsi/scheme.hpp>
#include <limits>
#include <string>
#include <vector>

#include "common/columns.hpp"

// What implicit diffusion gets right, and how well.

namespace gradpsi::apps::diffusion {

/// Held at 0, or without flux.
enum class Walls { Fixed, NoFlux };

/// An error for a time step or a spacing.
struct Result {
  std::string of;  ///< what was studied
  int dimension;
  Walls walls;
  double jitter;
  std::string method;  ///< of time steps, or a scheme
  double support_ratio;
  double step, error;
  double order =
      std::numeric_limits<double>::quiet_NaN();  ///< between the step before and this one
};

/// Orders in time on a decaying mode, u = sin(pi x) .. or cos(pi x) .., against small steps on the same
/// points, so that space has no part in the error.
std::vector<Result> time_orders(int dimension, Walls walls, bool quick);

/// Orders in space, against the mode's own decay by a factor e, with steps too small to matter.
std::vector<Result> space_orders(int dimension, Walls walls, double jitter, const Scheme& scheme,
                                 bool quick);

/// lap u = f for u = sin(2.5 x) cos(2.5 y) on irregular squares of 40 x 40 points, the outermost fixed: root
/// mean square over the points that are not fixed, three clouds.
Result poisson(const Scheme& scheme, double support_ratio);

/// The temperature where conductivities 1 and 10 meet, relative: kappa = 1 for x < 1/2 and 10 beyond,
/// u(0) = 0, u(1) = 1, so u = 10/11 at the interface. It lies midway between two columns of points; that
/// on the left, where u is steep, is looked at.
Result slab(const Scheme& scheme, double jitter, Mean mean);

/// The columns of the study's CSV.
Columns<Result> columns();

}  // namespace gradpsi::apps::diffusion
