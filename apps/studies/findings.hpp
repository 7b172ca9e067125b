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
  Eigen::VectorXd residual;   // per row, the largest of a promised condition, free of scale
  std::vector<int> evolving;  // points that are not fixed
  double spacing = 0;         // the usual one
  Eigen::VectorXd spacings;   // one for all, or one a point: local_spacing()
  // Of a Laplacian's evolving rows and columns:
  MatrixSummary matrix;
  Forecast forecast;
  std::optional<Spectrum> spectrum;

  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
  double unit() const { return spacing * spacing; }
  /// Of each row, times the largest derivative of the order that the scheme does not reach.
  Eigen::VectorXd error_bound() const { return rows.remainders.col(rows.remainders.cols() - 3); }
};

/// @param evolving  points that are not fixed
/// @param spectrum  whether a Laplacian's eigenvalues are wanted
Findings examine(const Scheme& scheme, const Problem& problem, const std::vector<int>& evolving,
                 bool spectrum, int threads);

/// A quantity of the rows, sorted.
struct Distribution {
  explicit Distribution(const Eigen::VectorXd& values);
  double quantile(double share) const;
  std::vector<double> values;
  Eigen::Index largest_at = 0, least_at = 0;
};

/// "point 7 (0.5, 0.25)"
std::string at(const Problem& problem, Eigen::Index i);

/// Adds what is known of each row.
void add_columns(Table& table, const RowReport& rows, const Findings& findings);

}  // namespace gradpsi::apps
