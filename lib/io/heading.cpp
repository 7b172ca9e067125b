#include "io/heading.hpp"

#include <algorithm>

#include "gradpsi/error.hpp"
#include "io/dialect.hpp"

namespace gradpsi {
namespace {

void check_names(const std::vector<std::string>& names, const std::string& place) {
  auto sorted = names;  // a line has room for 250,000 names
  std::ranges::sort(sorted);
  if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
    throw InvalidInput(place + "two columns are named '" + *twice + "'");
}

/// How many cells of a line are numbers.
int count_numbers(std::string_view line, char separator) {
  int count = 0;
  NumberReader numbers(separator);
  for_each_cell(line, separator, [&](std::string_view cell, bool) {
    double x;
    count += numbers.read(cell, x) != NumberReader::Result::Text;
  });
  return count;
}

bool is_all_numbers(std::string_view line) {
  const char separator = separator_of(line, line);
  return count_numbers(line, separator) == count_cells(line, separator);
}

bool is_all_quoted(std::string_view line) {
  bool result = true;
  for_each_cell(line, separator_of(line, line),
                [&](std::string_view, bool quoted) { result = result && quoted; });
  return result;
}

/// Whether a line names the columns of that below it: numbers do so only in quotes that those below have not.
bool is_header(std::string_view line, std::string_view row) {
  return !is_all_numbers(line) ||
         (is_all_quoted(line) && !(is_all_quoted(row) && is_all_numbers(row)));
}

bool ends_in_nothing(std::string_view line, char separator) {
  bool result = false;
  for_each_cell(line, separator,
                [&](std::string_view cell, bool quoted) { result = cell.empty() && !quoted; });
  return result;
}

/// @param row  the line below it
Head head(std::string_view line, std::string_view row, const std::string& place) {
  if (!is_text(line)) throw InvalidInput(place + "the header is not UTF-8 text");
  Head result;
  result.separator = separator_of(line, row);
  for_each_cell(line, result.separator, [&](std::string_view cell, bool quoted) {
    result.names.push_back(quoted ? unquoted(cell) : std::string(cell));
  });
  std::vector<std::string>& names = result.names;
  if (names.size() > 1 && names.front().empty()) names.front() = "index";  // of pandas
  if (names.size() > 1 && names.back().empty() && ends_in_nothing(row, result.separator)) {
    names.pop_back();
    result.ends_in_separator = true;
  }
  if (std::ranges::find(names, "") != names.end())
    throw InvalidInput(place + "a column has no name");
  check_names(names, place);
  return result;
}

}  // namespace

Beginning read_beginning(Lines& lines, const std::filesystem::path& file) {
  Beginning result;
  std::string_view line;
  for (std::int64_t begin = 0; result.lines.size() < 3 && lines.next(line);
       begin = lines.line_begin()) {
    const bool first = begin == 0;
    if (first && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    if (trimmed(line).empty()) {
      if (first) break;
      if (!result.lines.empty()) result.lines.push_back({"", lines.place(), begin});
    } else if (!is_comment(line)) {
      result.lines.push_back({std::string(line), lines.place(), begin});
    } else if (result.lines.empty()) {
      result.comment = Line{std::string(line), lines.place(), begin};
    }
  }
  if (result.lines.empty() && !result.comment)
    throw InvalidInput(file.string() + ":1: expected a header row such as x,y,volume");
  return result;
}

Head take_head(Beginning& beginning, const std::vector<std::string>& names) {
  std::vector<Line>& lines = beginning.lines;
  const auto line = [&](std::size_t k) { return k < lines.size() ? lines[k].text : ""; };
  if (lines.empty() || !is_header(line(0), line(1))) {
    const std::string row = line(0);
    if (!names.empty()) {
      check_names(names, "");
      return {names, separator_of(row, row)};
    }
    if (beginning.comment) {
      std::string_view text = trimmed(beginning.comment->text);
      text.remove_prefix(text.starts_with('#') ? 1 : 2);
      Head found = head(text, row, beginning.comment->place);
      if (row.empty() || count_cells(row, found.separator) == std::ssize(found.names)) return found;
    }
    throw InvalidInput(lines.front().place +
                       "expected a header row such as x,y,volume, found numbers: name the columns");
  }
  if (!names.empty())
    throw InvalidInput(lines.front().place + "names are given, but the file has a header");
  Head found = head(line(0), line(1), lines.front().place);
  const bool units = !line(1).empty() && count_numbers(line(1), found.separator) == 0 &&
                     count_numbers(line(2), found.separator) > 0;
  lines.erase(lines.begin(), lines.begin() + (units ? 2 : 1));
  return found;
}

}  // namespace gradpsi
