#pragma once

#include <array>
#include <gradpsi/scheme.hpp>
#include <limits>
#include <string>
#include <vector>

#include "common/progress.hpp"
#include "common/timing.hpp"
#include "studies/lattices.hpp"

// Accuracy and cost of every scheme, on u = a product of sin(4x + 1/2), sin(4y + 1), .. in the unit line,
// square or cube; and of the Dirichlet problem lap u = f whose outermost points are held.

namespace gradpsi::apps::tradeoff {

struct Study {
  int dimension;
  bool quick;  ///< two resolutions, two supports, one kernel
  int threads;
  double grading;  ///< of the lattices; supports are multiples of the local spacing
};

inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// What is measured of one matrix.
struct Result {
  Scheme scheme;
  int kernel;  ///< of kernels()
  Arrangement arrangement;
  double support_ratio;
  int points;
  double tolerance = 0;  ///< > 0: rows are chosen to it, of the scheme only the derivative counts
  double entries_per_row = 0, bytes_per_point = 0;
  /// Relative to the largest value of the derivative, of the Dirichlet problem to 1.
  double l2 = not_a_number, max = not_a_number;
  double solution_l2 = not_a_number, solution_max = not_a_number;
  double assemble = 0, product = 0, solve = not_a_number;  ///< seconds a point
  bool grows = false;                                      ///< Laplacians, outermost points held

  bool chosen() const { return tolerance > 0; }
  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
};
std::vector<Result> results(const Study& study, Timer& timer, const ShowProgress& show);

/// tradeoff.csv
std::string csv(const std::vector<Result>& results, int dimension);

/// What a derivative is wanted for: the seconds it takes and the error it has, for the whole cloud.
struct Use {
  const char* key;
  const char* text;
  double (*seconds)(const Result&);
  double Result::*error;
  bool stable_only;
};
inline constexpr std::array uses = {
    Use{"assemble", "one derivative on new points (search and weights)",
        [](const Result& r) { return r.assemble * r.points; }, &Result::l2, false},
    Use{"product", "one more derivative on the same points (a product)",
        [](const Result& r) { return r.product * r.points; }, &Result::l2, false},
    Use{"solve", "the Dirichlet problem (search, weights, solution)",
        [](const Result& r) { return (r.assemble + r.solve) * r.points; }, &Result::solution_l2,
        true}};

/// Results of one derivative on one arrangement, by what they are wanted for.
struct Front {
  Derivative derivative;
  Use use;
  Arrangement arrangement;
  /// Of the single schemes those that nothing else is both cheaper and more accurate than, cheapest first.
  std::vector<const Result*> best;
  double uncorrected = 1e300;  ///< least error of the schemes without correction

  /// How much longer twice the accuracy takes along the front.
  double price_of_a_factor_2() const;
};
Front front(const std::vector<Result>& results, Derivative derivative, const Use& use,
            Arrangement arrangement);

/// tradeoff_front.csv
std::string front_csv(const std::vector<Result>& results);

}  // namespace gradpsi::apps::tradeoff
