#pragma once

#include <gradpsi/scheme.hpp>
#include <gradpsi/spectrum.hpp>
#include <string>
#include <vector>

#include "studies/scattered.hpp"
#include "studies/stability.hpp"

// What forecast() says of matrices on scattered points, against their eigenvalues.

namespace gradpsi::apps::foretold {

/// One matrix.
struct Case {
  const scattered::Kind* kind;
  Scheme scheme;
  double support_ratio;
  stability::Walls walls;
  int seed;
};

struct Result {
  Case of;
  int points = 0;   ///< that evolve
  double rate = 0;  ///< of the fastest growth, by the eigenvalues; times the square of the spacing
  double zero = 0;  ///< up to which rates are none
  Forecast forecast;  ///< its rate likewise
  bool grows() const { return rate > zero; }
};

/// Every Laplacian on every kind of points.
std::vector<Result> results(const stability::Study& study, const ShowProgress& show);

/// forecast.csv
std::string csv(const std::vector<Result>& results, int dimension);

/// How often the forecasts were right, by kind of points; for people.
std::string table(const std::vector<Result>& results);

}  // namespace gradpsi::apps::foretold
