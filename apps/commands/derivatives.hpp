#pragma once

#include <gradpsi/vector_calculus.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/operators.hpp"

// What `derive` computes of which columns, and what the results are called.

namespace gradpsi::apps {

/// A row of the table of --what.
struct Quantity {
  const char* name;
  Derivative derivative;  ///< of the scheme that it takes
  /// Of columns that are the components of one vector; unset: each column is differentiated by itself.
  std::optional<VectorOperator> of_vector;
  const char* prefix;  ///< of the new columns, followed by what is differentiated and the component
  const char* vector;  ///< where the new columns are a vector's components, the prefix of its name
};
std::span<const Quantity> quantities();
std::vector<std::string> quantity_names();

/// The row of that name; without a name what the scheme approximates.
/// @throws BadUsage  if the scheme approximates another derivative, naming some of the right one
const Quantity& quantity(const std::string& name, const Scheme& scheme);

/// The row of that name, where no scheme says what is approximated.
/// @throws BadUsage  without a name
const Quantity& quantity(const std::string& name);

/// The columns of a list "vx,vy".
/// @throws BadUsage  if a name is missing or there twice
std::vector<std::string> field_names(const std::string& list);

/// Throws BadUsage unless these columns can be what the quantity is taken of, on points with these axes.
void check_fields(const Quantity& what, const std::vector<std::string>& fields,
                  const OperatorOptions& options, const std::string& axes);

/// Adds the quantity's columns to the table: nan in `unanswered` rows of the operator and at points
/// without a row. Vectors are told to the table, too: write_vtu() writes them.
/// @param u  n x fields, the columns' numbers
void add_quantity(const Quantity& what, const std::vector<std::string>& fields,
                  const Eigen::MatrixXd& u, const std::vector<int>& unanswered, int threads,
                  Problem& problem);

}  // namespace gradpsi::apps
