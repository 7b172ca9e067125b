#pragma once

#include <cstdint>
#include <gradpsi/cited.hpp>
#include <gradpsi/operator.hpp>
#include <gradpsi/rows.hpp>
#include <gradpsi/scheme.hpp>
#include <gradpsi/solver.hpp>
#include <gradpsi/spectrum.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

// What --report and --json write: values, turned into JSON once they are all known.

namespace gradpsi::apps {

struct NeighbourCounts {
  int min = 0;
  double median = 0;
  int max = 0;
};

struct Seconds {
  double read = 0, search = 0, weights = 0, write = 0;
};

/// A row that was not computed as asked.
struct DegenerateRow {
  std::int64_t point;  ///< its number
  RowOutcome outcome;
  int degree, neighbours;
  double support, reciprocal_condition;
};

struct DegenerateRows {
  std::int64_t lowered = 0, widened = 0, zero = 0;
  std::vector<DegenerateRow> rows;  ///< of very many only some

  std::int64_t count() const { return lowered + widened + zero; }
};

/// The smallest reciprocal condition number, and the number of its point.
struct WorstRow {
  double reciprocal_condition;
  std::int64_t point;
};

/// Steps of diffusion: largest residual; sums of iterations and seconds.
struct Steps {
  int count = 0;
  SolveReport total = {};
  std::vector<double> convergence =
      {};  ///< relative residuals after each iteration of the latest step
};

/// How a quantity of the rows is distributed; nan of no rows.
struct Spread {
  double min = 0, median = 0, max = 0;
  std::int64_t point_of_max = -1;
};

/// How many walls there are, and what became of their rows.
struct WallRows {
  std::int64_t count = 0;
  std::int64_t second_order = 0,
               first_order = 0;  ///< rows that know the slope; first_order: were lowered
  std::int64_t by_gradient = 0;  ///< conditions n . grad u = 0, of a gradient's rows
};

/// What an operator is fit for.
struct Inspection {
  struct Matrix {
    std::int64_t points;  ///< that evolve
    MatrixSummary summary;
    WallRows walls;
  };
  struct Verdict {
    Forecast growth;    ///< by the spectrum, if it was asked for
    double euler_step;  ///< dt nu
    std::string explicit_steps, implicit_steps;
  };
  std::string scheme;
  double spacing = 0;
  Spread reciprocal_condition, amplification, negative_share, residual, error_bound;
  std::string derivatives;
  // Of Laplacians:
  std::optional<Matrix> matrix = {};
  std::optional<Verdict> verdict = {};
  std::optional<Spectrum> spectrum = {};  ///< if it was asked for
};

/// What --report writes.
struct Report {
  std::int64_t points = 0, entries = 0;
  NeighbourCounts neighbours;
  Seconds seconds;
  std::int64_t degenerate_rows = 0;  ///< those of the walls' gradient, too
  std::int64_t dropped_points = 0, peak_bytes = 0;
  int threads = 0;
  std::optional<int> processes;
  std::optional<std::int64_t> probes;
  std::vector<std::string> warnings;
  DegenerateRows degenerate;
  std::map<std::string, std::int64_t>
      schemes;                          ///< of rows chosen to a tolerance: how many are by each
  std::optional<double> largest_error;  ///< of these, of those that are not zero
  double tolerance = 0;                 ///< that they were chosen to
  std::string wavelength;               ///< its number, or a column
  std::optional<Inspection> inspection;
  std::optional<SolverReport> solver;
  std::optional<Steps> steps;
  std::optional<WorstRow> worst;     ///< for people alone
  std::optional<std::int64_t> rows;  ///< how many were asked for, if not all; for people alone
  bool supports_differ = false;      ///< for people alone
};
std::string json(const Report& report);

/// The table of schemes.
std::string json(std::span<const Scheme> schemes);
std::string json(std::span<const CitedSystem> systems);

}  // namespace gradpsi::apps
