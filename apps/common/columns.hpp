#pragma once

#include <concepts>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

// Tables, written from one list of columns: each has its heading, and what of a row stands in it.

namespace gradpsi::apps {

/// A number by a printf format; one that is not finite as nothing.
std::string cell(double x, const char* format = "%.9g");

/// Text filled up with spaces to `width` characters, on the left; width < 0: to -width, on the right.
std::string padded(const std::string& text, int width);

/// How the cells of a column are written.
struct Look {
  const char* format = "%.9g";  ///< of numbers that are not whole
  int width = 0;                ///< in a text table, as padded() takes it
};

/// A column of a table whose rows are `Row`s.
template <class Row>
struct Column {
  std::string heading;
  Look look;
  std::function<std::string(const Row&)> text;  ///< what a row's cell says

  /// @param value  a member of `Row` or a function of it: a number or a text
  template <class Value>
  Column(std::string over_it, Value value, Look as = {})
      : heading(std::move(over_it)), look(as), text([value, as](const Row& row) {
          static_cast<void>(as);  // not all cells are numbers
          using Cell = std::remove_cvref_t<std::invoke_result_t<Value, const Row&>>;
          if constexpr (std::convertible_to<Cell, std::string_view>)
            return std::string(std::invoke(value, row));
          else if constexpr (std::integral<Cell>)
            return std::to_string(std::invoke(value, row));
          else
            return cell(std::invoke(value, row), as.format);
        }) {}
};

template <class Row>
using Columns = std::vector<Column<Row>>;

/// The headings as a line of a CSV file.
template <class Row>
std::string csv_heading(const Columns<Row>& columns) {
  std::string line;
  for (const auto& column : columns) line += (line.empty() ? "" : ",") + column.heading;
  return line + '\n';
}

/// Rows as lines of a CSV file.
template <class Row>
std::string csv_lines(const Columns<Row>& columns, const std::vector<Row>& rows) {
  std::string lines;
  for (const Row& row : rows)
    for (const auto& column : columns)
      lines += column.text(row) + (&column == &columns.back() ? '\n' : ',');
  return lines;
}

/// A CSV file: the headings, then the rows.
template <class Row>
std::string csv(const Columns<Row>& columns, const std::vector<Row>& rows) {
  return csv_heading(columns) + csv_lines(columns, rows);
}

/// The headings as a line of a text table. One that is wider than its column moves those after it.
template <class Row>
std::string text_heading(const Columns<Row>& columns) {
  std::string line;
  for (const auto& column : columns) line += padded(column.heading, column.look.width);
  return line + '\n';
}

/// Rows as lines of a text table, aligned.
template <class Row>
std::string text_lines(const Columns<Row>& columns, const std::vector<Row>& rows) {
  std::string lines;
  for (const Row& row : rows) {
    for (const auto& column : columns) lines += padded(column.text(row), column.look.width);
    lines += '\n';
  }
  return lines;
}

/// A text table: the headings, then the rows.
template <class Row>
std::string text_table(const Columns<Row>& columns, const std::vector<Row>& rows) {
  return text_heading(columns) + text_lines(columns, rows);
}

}  // namespace gradpsi::apps
