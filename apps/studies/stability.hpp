#pragma once

#include <array>
#include <gradpsi/scheme.hpp>
#include <gradpsi/spectrum.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/progress.hpp"

// Whether du/dt = lap u grows: every Laplacian on jittered lattices of the unit line, square or cube.

namespace gradpsi::apps::stability {

/// In a periodic box, with the outermost layer held, or cut off without any condition.
enum class Walls { Periodic, Dirichlet, Truncated };
inline constexpr std::array<std::string_view, 3> wall_names = {"periodic", "dirichlet",
                                                               "truncated"};

struct Study {
  int dimension;
  bool quick;  ///< fewer points, supports, jitters and seeds
  int threads;
};

/// One matrix.
struct Case {
  Scheme scheme;
  double support_ratio, jitter;
  Walls walls;
  int seed;
};

struct Result {
  Case of;
  int points = 0;
  double max_real = 0, min_real = 0, max_imag = 0;  ///< of the eigenvalues, times dx^2
  double worst_rcond = 1, worst_amplification = 0, negative_share = 0;
  double error_l2 = 0, error_max = 0, bound_max = 0;  ///< of a wave's Laplacian
  double bound_over_error = 0;                        ///< at the point of the largest error
  int rows_above_bound = 0;
  bool grows = false;
  Forecast forecast;
};
std::vector<Result> results(const Study& study, const ShowProgress& show);

/// stability.csv
std::string csv(const std::vector<Result>& results, int dimension);

/// For the maps: the fastest growth of all seeds, 0 where none grows.
std::string map_csv(const std::vector<Result>& results);

/// Matrices of a scheme that grow, of those made, and what was foretold; for people.
std::string growth_table(const std::vector<Result>& results);

/// How many errors are above their bounds, and how far bounds are above errors; for people.
std::string bound_line(const std::vector<Result>& results);

}  // namespace gradpsi::apps::stability
