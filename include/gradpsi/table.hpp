#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Columns that are the components of one vector.
struct TableVector {
  std::string name;                    ///< no column's
  std::array<std::string, 3> columns;  ///< along x, y and z; "": 0
};

/// The cells of a column that are no numbers, or whole ones beyond 2^53, as they stand in the file.
struct TextColumn {
  std::string name;                ///< the column's
  std::vector<std::string> cells;  ///< one a row
  std::string unread;  ///< what is wrong with the first that is no number, and where; "": all are
};

/// Named columns of equal length, a field's values contiguous.
struct Table {
  std::vector<std::string> names;  ///< no two alike
  DenseMatrix values;              ///< rows x columns, as many columns as names
  /// What write_vtu() writes as vectors, beside their columns; other formats have the columns only.
  std::vector<TableVector> vectors = {};
  /// Columns that write_csv() writes as texts, as they came; their values are nan where there is no number.
  std::vector<TextColumn> texts = {};

  /// Whether there is a column of that name.
  bool has(std::string_view name) const;
  /// The texts of a column, null if it has none.
  const TextColumn* text(std::string_view name) const;
  /// @throws InvalidInput  if there is no such column, listing those there are; if a cell is no number, saying where
  DenseVector column(std::string_view name) const;
  /// @throws InvalidInput  if the name is taken or the length differs
  void add(const std::string& name, const VectorView& values);
  /// Says that columns are the components of a vector along x, y and z; "": there is none.
  /// @throws InvalidInput  if the name is taken or there is no such column
  void add_vector(const std::string& name, const std::array<std::string, 3>& columns);
  /// Gives a column other values.
  /// @throws InvalidInput  if there is no such column or the length differs
  void set(std::string_view name, const VectorView& values);
  /// The rows of these indices, each from 0 to rows - 1, in this order.
  Table select(const std::vector<int>& rows) const;
};

/// The points of a table: columns x, then y, then z give position and dimension; `volume`, if there,
/// the volumes, rather than those of the options.
/// @throws InvalidInput  if there is no x, a z without y, or what Cloud() refuses
Cloud make_cloud(const Table& table, CloudOptions options = {});

}  // namespace gradpsi
#pragma GCC visibility pop
