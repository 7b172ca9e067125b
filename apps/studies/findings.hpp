#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/operators.hpp"

// What is known about an operator and its rows.

namespace gradpsi::apps {

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
  std::vector<int> evolving;  // points that are not fixed
  double spacing = 0;         // the usual one
  Eigen::VectorXd spacings;   // one for all, or one a point: local_spacing()
  // Of a Laplacian's evolving rows and columns:
  MatrixSummary matrix;
  Forecast growth;  // what the spectrum says, if it was asked for
  std::optional<Spectrum> spectrum;

  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
  double unit() const { return spacing * spacing; }
};

/// @param evolving  points that are not fixed
/// @param spectrum  whether a Laplacian's eigenvalues are wanted
Findings examine(const Scheme& scheme, const Problem& problem, const std::vector<int>& evolving,
                 bool spectrum, int threads);

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
