#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "io/dialect.hpp"
#include "io/file.hpp"
#include "io/heading.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

constexpr double whole_beyond = 9007199254740992;  // 2^53: not every whole number is a double

/// The rows of a file as they are read.
class Rows {
 public:
  explicit Rows(Head head) : head_(std::move(head)), numbers_(head_.separator), text_(size(), -1) {}

  /// @param place  () gives "file:line: " for messages
  template <class Place>
  void add(std::string_view line, const Place& place);
  Table table() &&;

 private:
  std::ptrdiff_t size() const { return std::ssize(head_.names); }
  void keep_text(std::size_t column, std::string_view cell, bool quoted);
  [[noreturn]] void throw_ragged(std::string_view line, std::ptrdiff_t columns,
                                 const std::string& place) const;

  Head head_;
  NumberReader numbers_;
  std::vector<double> values_;  // row by row
  std::vector<int> text_;       // where in texts_ a column is, or -1
  std::vector<TextColumn> texts_;
};

/// In quotes, those inside twice.
std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

/// A text as a cell of a row, which has others unless it is alone.
std::string cell(const std::string& text, bool alone) {
  const bool needed = text.find_first_of(",\"") != text.npos || trimmed(text) != text ||
                      is_comment(text) || (alone && text.empty());
  return needed ? in_quotes(text) : text;
}

/// Of a column with a cell that is no number, all cells; those before it were numbers.
void Rows::keep_text(std::size_t column, std::string_view cell, bool quoted) {
  if (text_[column] < 0) {
    text_[column] = static_cast<int>(texts_.size());
    texts_.push_back({head_.names[column], {}, {}});
    for (std::size_t k = column; k + 1 < values_.size(); k += size())
      texts_.back().cells.push_back(shortest(values_[k]));
  }
  texts_[text_[column]].cells.push_back(quoted ? unquoted(cell) : std::string(cell));
}

template <class Place>
void Rows::add(std::string_view line, const Place& place) {
  std::ptrdiff_t columns = 0;
  bool beyond = false;  // whether something stands there
  for_each_cell(line, head_.separator, [&](std::string_view cell, bool quoted) {
    if (++columns > size()) {
      beyond = beyond || !cell.empty();
      return;
    }
    const auto column = static_cast<std::size_t>(columns - 1);
    double x = 0;
    const auto result = numbers_.read(cell, x);
    const bool is_number = result == NumberReader::Result::Number;
    values_.push_back(is_number ? x : std::numeric_limits<double>::quiet_NaN());
    const bool exact = is_number && !(std::abs(x) >= whole_beyond && std::isfinite(x) &&
                                      cell.find_first_not_of("+-0123456789") == cell.npos);
    if (exact && text_[column] < 0) return;
    if (!is_text(cell))
      throw InvalidInput(place() + "column '" + head_.names[column] + "': '" + excerpt(cell) +
                         "' is not a number");
    // Written, commas part cells: numbers with a decimal one would be none.
    if (is_number && cell.find(',') != cell.npos)
      keep_text(column, shortest(x), false);
    else
      keep_text(column, cell, quoted);
    std::string& why = texts_[text_[column]].unread;
    if (is_number || !why.empty()) return;
    why = place() + "column '" + head_.names[column] + "': ";
    why += result == NumberReader::Result::BeyondDouble
               ? excerpt(cell) + " is beyond the range of a double"
               : "'" + excerpt(cell) + "' is not a number";
  });
  if (head_.ends_in_separator && columns == size() + 1 && !beyond) --columns;
  if (columns != size()) throw_ragged(line, columns, place());
}

void Rows::throw_ragged(std::string_view line, std::ptrdiff_t columns,
                        const std::string& place) const {
  const char own = separator_of(line, line);
  const auto called = [](char separator) {
    return separator == ' '    ? std::string("blanks")
           : separator == '\t' ? std::string("tabs")
                               : std::string("'") + separator + "'";
  };
  std::string hint;
  if (own != head_.separator && columns == 1)
    hint = "; it looks parted by " + called(own) + ", the header by " + called(head_.separator);
  else if (head_.separator == ',' && columns == 2 * size())
    hint = "; with decimal commas, ';', tabs or blanks must part the cells";
  throw InvalidInput(place + std::to_string(columns) + " columns where the header has " +
                     std::to_string(size()) + hint);
}

Table Rows::table() && {
  Table result;
  result.names = std::move(head_.names);
  const auto columns = static_cast<Eigen::Index>(result.names.size());
  result.values = Eigen::Map<const Positions>(
      values_.data(), static_cast<Eigen::Index>(values_.size()) / columns, columns);
  result.texts = std::move(texts_);
  return result;
}

/// A name as it stands in a header.
std::string header_cell(const std::string& name, const Table& table) {
  double x;
  const bool read_otherwise = NumberReader(',').read(name, x) != NumberReader::Result::Text ||
                              is_comment(name) || name.find_first_of(",;\t\"") != name.npos ||
                              name.starts_with("\xEF\xBB\xBF") || trimmed(name) != name ||
                              (table.names.size() == 1 && name.find(' ') != name.npos);
  return read_otherwise ? in_quotes(name) : name;
}

const char* separator(std::size_t column, const Table& table) {
  return column + 1 < table.names.size() ? "," : "\n";
}

void write_header(Output& out, const Table& table) {
  for (std::size_t c = 0; c < table.names.size(); ++c)
    out << header_cell(table.names[c], table) << separator(c, table);
}

void write_rows(Output& out, const Table& table) {
  std::vector<const TextColumn*> texts;
  for (const std::string& name : table.names) texts.push_back(table.text(name));
  for (Eigen::Index i = 0; i < table.values.rows(); ++i)
    for (std::size_t c = 0; c < texts.size(); ++c) {
      if (texts[c])
        out << cell(texts[c]->cells[i], texts.size() == 1);
      else
        out << table.values(i, static_cast<Eigen::Index>(c));
      out << separator(c, table);
    }
}

}  // namespace

Table read_csv(const path& file) { return read_csv(file, 0, 1); }

Table read_csv(const path& file, int part, int parts, const std::vector<std::string>& names) {
  if (part < 0 || part >= parts)
    throw InvalidInput("there is no part " + std::to_string(part) + " of " + std::to_string(parts));
  Lines lines(file);
  const std::int64_t size = parts > 1 ? lines.size() : 0;  // a pipe is refused before it is read
  Beginning beginning = read_beginning(lines, file);
  Rows rows(take_head(beginning, names));

  // A line belongs to the part in which it begins.
  std::int64_t begin = 0, end = std::numeric_limits<std::int64_t>::max();
  if (parts > 1) {
    const std::int64_t first =
        beginning.lines.empty() ? lines.line_begin() : beginning.lines.front().begin;
    const std::int64_t bytes = std::max<std::int64_t>(size - first, 0);
    const auto begin_of = [&](int p) {
      return first + bytes / parts * p + bytes % parts * p / parts;
    };
    begin = begin_of(part);
    if (part < parts - 1) end = begin_of(part + 1);
  }

  std::string blank;  // where an empty line stands, allowed only at the end
  const auto add = [&](std::string_view line, const auto& place) {
    if (trimmed(line).empty()) {
      if (blank.empty()) blank = place();
      return;
    }
    if (is_comment(line)) return;
    if (!blank.empty()) throw InvalidInput(blank + "the line is empty");
    rows.add(line, place);
  };
  for (const Line& line : beginning.lines)
    if (line.begin >= begin && (line.begin < end || !blank.empty()))
      add(line.text, [&] { return line.place; });
  lines.skip_to(begin);
  std::string_view line;
  while ((lines.line_begin() < end || !blank.empty()) && lines.next(line))
    add(line, [&] { return lines.place(); });
  return std::move(rows).table();
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
