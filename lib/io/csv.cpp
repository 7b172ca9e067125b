#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <string>
#include <system_error>
#include <vector>

#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "io/file.hpp"
#include "io/text.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

std::vector<std::string> header(std::string_view line, const std::string& place) {
  if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  if (line.starts_with('#')) line.remove_prefix(1);  // as numpy writes headers
  if (!is_text(line)) throw InvalidInput(place + "the header is not UTF-8 text");
  std::vector<std::string> names;
  for_each_cell(line, [&](std::string_view cell) {
    if (cell.size() >= 2 && cell.starts_with('"') && cell.ends_with('"'))
      cell = cell.substr(1, cell.size() - 2);
    if (cell.empty()) throw InvalidInput(place + "a column has no name");
    names.emplace_back(cell);
  });
  auto sorted = names;  // a line has room for 250,000 names
  std::ranges::sort(sorted);
  if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
    throw InvalidInput(place + "two columns are named '" + *twice + "'");
  return names;
}

/// A name as header() reads it back: in quotes if it would otherwise lose its blanks, quotes or #.
std::string header_cell(const std::string& name) {
  const bool quoted = name.size() >= 2 && name.starts_with('"') && name.ends_with('"');
  const bool marked = name.starts_with('#') || name.starts_with("\xEF\xBB\xBF");
  return quoted || marked || trimmed(name) != name ? '"' + name + '"' : name;
}

void parse_row(std::string_view line, const std::vector<std::string>& names, const Lines& lines,
               std::vector<double>& values) {
  std::size_t columns = 0;
  for_each_cell(line, [&](std::string_view cell) {
    if (columns++ >= names.size()) return;
    std::string_view digits = cell;
    if (cell.starts_with('+') && !cell.starts_with("+-")) digits.remove_prefix(1);
    double x;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (error == std::errc::result_out_of_range)
      throw InvalidInput(lines.place() + "column '" + names[columns - 1] + "': " + excerpt(cell) +
                         " is beyond the range of a double");
    if (error != std::errc() || end != cell.data() + cell.size())
      throw InvalidInput(lines.place() + "column '" + names[columns - 1] + "': '" + excerpt(cell) +
                         "' is not a number");
    values.push_back(x);
  });
  if (columns != names.size())
    throw InvalidInput(lines.place() + std::to_string(columns) + " columns where the header has " +
                       std::to_string(names.size()));
}

const char* separator(Eigen::Index column, const Table& table) {
  return column + 1 < table.values.cols() ? "," : "\n";
}

void write_header(Output& out, const Table& table) {
  for (Eigen::Index c = 0; c < table.values.cols(); ++c)
    out << header_cell(table.names[c]) << separator(c, table);
}

void write_rows(Output& out, const Table& table) {
  for (Eigen::Index i = 0; i < table.values.rows(); ++i)
    for (Eigen::Index c = 0; c < table.values.cols(); ++c)
      out << table.values(i, c) << separator(c, table);
}

}  // namespace

Table read_csv(const path& file) { return read_csv(file, 0, 1); }

Table read_csv(const path& file, int part, int parts) {
  if (part < 0 || part >= parts)
    throw InvalidInput("there is no part " + std::to_string(part) + " of " + std::to_string(parts));
  Lines lines(file);
  const std::int64_t size = parts > 1 ? lines.size() : 0;  // a pipe is refused before it is read
  std::string_view line;
  if (!lines.next(line) || trimmed(line).empty())
    throw InvalidInput(file.string() + ":1: expected a header row such as x,y,volume");
  Table table;
  table.names = header(line, lines.place());

  // A line belongs to the part in which it begins.
  std::int64_t end = std::numeric_limits<std::int64_t>::max();
  if (parts > 1) {
    const std::int64_t first = lines.line_begin(), bytes = std::max<std::int64_t>(size - first, 0);
    const auto begin_of = [&](int p) {
      return first + bytes / parts * p + bytes % parts * p / parts;
    };
    lines.skip_to(begin_of(part));
    if (part < parts - 1) end = begin_of(part + 1);
  }

  std::vector<double> values;  // row by row
  std::string blank;           // where an empty line stands, allowed only at the end
  while ((lines.line_begin() < end || !blank.empty()) && lines.next(line)) {
    if (trimmed(line).empty()) {
      if (blank.empty()) blank = lines.place();
      continue;
    }
    if (!blank.empty()) throw InvalidInput(blank + "the line is empty");
    parse_row(line, table.names, lines, values);
  }
  const auto columns = static_cast<Eigen::Index>(table.names.size());
  table.values = Eigen::Map<const Positions>(
      values.data(), static_cast<Eigen::Index>(values.size()) / columns, columns);
  return table;
}

void write_csv(const path& file, const Table& table) {
  write_file(file, [&](Output& out) {
    write_header(out, table);
    write_rows(out, table);
  });
}

void write_csv(const path& file, const std::function<bool(Table&)>& next) {
  write_file(file, [&](Output& out) {
    Table table;
    for (bool first = true; next(table); first = false) {
      if (first) write_header(out, table);
      write_rows(out, table);
    }
  });
}

}  // namespace gradpsi
