#pragma once

#include <gradpsi/assemble.hpp>
#include <gradpsi/cloud.hpp>
#include <gradpsi/scheme.hpp>
#include <optional>
#include <vector>

#include "common/timing.hpp"

// Which scheme and support suit given points: every scheme of the wanted derivative is tried with five
// supports, on waves in a few directions, at a sample of the points. The cheapest one whose error is at
// most the tolerance, and that is stable where it is to be stepped in time, is the choice.

namespace gradpsi::apps::candidates {

/// What the derivative is for.
enum class Use { Derivative, Explicit, Implicit };

/// Unit waves on the points and what their derivatives are: a column per wave, and per axis for gradients.
struct Waves {
  Eigen::MatrixXd u;                         ///< n x waves
  std::vector<Eigen::MatrixXd> derivatives;  ///< per axis (Laplacian: one), n x waves
  double scale;                              ///< root mean square of a derivative
};

/// Along the axes and the diagonals, as sine and as cosine; in a periodic box the nearest that fit it.
Waves waves(const Cloud& cloud, double wavelength, Derivative derivative);

/// What the candidates are tried on.
struct Trial {
  Derivative derivative;
  Use use;
  double
      tolerance;  ///< of the root mean square error over the points, relative to that of the derivative
  const Cloud& cloud;
  double spacing;            ///< the usual one
  Eigen::VectorXd spacings;  ///< local_spacing()
  Eigen::VectorXd supports;  ///< a column of the points; empty: supports are tried
  Waves waves;
  std::vector<int> evolving;  ///< points without a fixed value
  std::vector<int> sample;    ///< of them
  AssemblyOptions assembly;

  /// One for all, or one a point.
  Eigen::VectorXd supports_of(double support_ratio) const {
    return supports.size() > 0 ? supports : Eigen::VectorXd(support_ratio * spacings);
  }
  bool laplacian() const { return derivative == Derivative::Laplacian; }
};

/// So many of the points, at random but always the same, ascending; 0: all.
std::vector<int> sampled(std::vector<int> points, int count);

/// A scheme and a support, and what has been measured of them.
struct Candidate {
  Scheme scheme;
  double support_ratio;              ///< nan: supports are a column of the points
  double error = 0, worst = 0;       ///< root mean square and largest over the rows, relative
  double entries = 0;                ///< a row
  double assemble = 0, product = 0;  ///< seconds a point
  double step = 0;                   ///< Laplacians: dt nu that explicit Euler bears, by Gershgorin
  /// A derivative: seconds a point for search, weights and a product. Explicit steps: entries of a row over
  /// the largest step, the work for a given time. Implicit ones: entries of a row, which filling and
  /// solving grow with.
  double cost = 0;
  int zero = 0, widened = 0;  ///< rows
  /// Whether errors, rows and step are those of all rows, and `grows` is known.
  bool looked_at = false;
  bool grows = false;

  bool complete() const { return zero == 0; }
};

/// All candidates, measured at these points; the cheapest first.
std::vector<Candidate> candidates(const Trial& trial, const std::vector<int>& points, Timer& timer);

/// The first that is complete, stable where it has to be, and accurate enough; null: none. Candidates that
/// could be are looked at.
Candidate* cheapest(const Trial& trial, std::vector<Candidate>& by_cost);

/// The most accurate that is complete, and stable where it has to be; null: none.
Candidate* most_accurate(const Trial& trial, std::vector<Candidate>& all);

/// The order of the error on disordered points.
int order(const Scheme& scheme);

/// A spacing that would do, and what it would do with.
struct Spacing {
  double spacing;
  const Candidate* candidate;
};

/// Errors fall with the order, so the coarsest spacing is that of the scheme that needs least; none below a
/// hundredth of what it is now.
std::optional<Spacing> sufficient_spacing(const Trial& trial, std::vector<Candidate>& all);

}  // namespace gradpsi::apps::candidates
