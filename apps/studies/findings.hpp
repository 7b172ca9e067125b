#pragma once

#include <cstdint>
#include <gradpsi/diffusion.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/operators.hpp"

// What is known about an operator and its rows.

namespace gradpsi::apps {

/// The system that is stepped in time, its Laplacian's rows at walls included.
struct Stepped {
  /// n x n, of which the rows and columns of `evolving` count.
  SparseMatrix matrix = {};
  /// Points that are not fixed, and whose value no condition says; ascending.
  std::vector<int> evolving = {};
  std::int64_t zero = 0;  ///< rows of these that could not be computed
  WallRows walls = {};
};

/// @param laplacian   with_walls()
/// @param conditions  fixed points, and walls that it has not taken up
Stepped stepped(const Operator& laplacian, const BoundaryConditions& conditions);

/// Everything that is known about the operator.
struct Findings {
  Findings(const Scheme& scheme, RowDiagnosis rows) : scheme(scheme), rows(std::move(rows)) {}

  Scheme scheme;
  RowDiagnosis rows;
  // Per row, the largest of a promised condition, free of scale; nan in zero rows.
  Eigen::VectorXd residual;
  // Per row, what error_bound() gives in units of the largest derivative of u of the order above the
  // scheme's degree; nan in rows that promise less, or less than a derivative of this order takes.
  Eigen::VectorXd error_bound;
  double spacing = 0;        // the usual one
  Eigen::VectorXd spacings;  // one for all, or one a point: local_spacing()
  Stepped stepped;           // of Laplacians, as are:
  MatrixSummary matrix;
  Forecast growth;  // what the spectrum says, if it was asked for
  std::optional<Spectrum> spectrum;

  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
  double unit() const { return spacing * spacing; }
};

/// @param stepped   of a Laplacian
/// @param spectrum  whether a Laplacian's eigenvalues are wanted
Findings examine(const Scheme& scheme, const Problem& problem, Stepped stepped, bool spectrum,
                 int threads);

/// A quantity of the rows, sorted; rows in which it is nan do not count.
struct Distribution {
  explicit Distribution(const Eigen::VectorXd& values);
  double quantile(double share) const;  // nan of none
  std::vector<double> values;
  Eigen::Index largest_at = -1, least_at = -1;
};

/// "point 7 (0.5, 0.25)"
std::string at(const Problem& problem, Eigen::Index i);

/// Adds what is known of each row.
void add_columns(Table& table, const RowReport& rows, const Findings& findings);

}  // namespace gradpsi::apps
