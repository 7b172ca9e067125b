#include "io/dialect.hpp"

#include <algorithm>
#include <charconv>

namespace gradpsi {
namespace {

NumberReader::Result parse(std::string_view cell, double& x) {
  using enum NumberReader::Result;
  std::string_view digits = cell;
  if (cell.starts_with('+') && !cell.starts_with("+-")) digits.remove_prefix(1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
  if (end != digits.data() + digits.size()) return Text;
  return error == std::errc()                      ? Number
         : error == std::errc::result_out_of_range ? BeyondDouble
                                                   : Text;
}

/// How many parts a line has between these separators, those in quotes being none.
int count_parts(std::string_view line, char separator) {
  int count = 1;
  bool quoted = false, blank = false;
  for (const char c : trimmed(line)) {
    if (c == '"') quoted = !quoted;
    const bool is_blank = c == ' ' || c == '\t';
    if (!quoted) count += separator == ' ' ? is_blank && !blank : c == separator;
    blank = is_blank && !quoted;
  }
  return count;
}

}  // namespace

QuotedCell take_quoted(std::string_view& line, char separator) {
  std::size_t end = 1;
  for (;; end += 2) {
    end = line.find('"', end);
    if (end == line.npos) return {{}, false, false};
    if (end + 1 == line.size() || line[end + 1] != '"') break;
  }
  const std::string_view inside = line.substr(1, end - 1), behind = line.substr(end + 1);
  if (separator == ' ') {
    line = trimmed(behind);
    return {inside, line.empty() || line.size() < behind.size(), line.empty()};
  }
  const auto at = behind.find(separator);
  if (!trimmed(behind.substr(0, at)).empty()) return {{}, false, false};
  if (at != behind.npos) line = behind.substr(at + 1);
  return {inside, true, at == behind.npos};
}

std::string unquoted(std::string_view inside) {
  std::string result;
  for (std::size_t k = 0; k < inside.size(); ++k) {
    result += inside[k];
    if (inside[k] == '"' && k + 1 < inside.size() && inside[k + 1] == '"') ++k;
  }
  return result;
}

int count_cells(std::string_view line, char separator) {
  int count = 0;
  for_each_cell(line, separator, [&](std::string_view, bool) { ++count; });
  return count;
}

char separator_of(std::string_view header, std::string_view row) {
  constexpr char all[] = {';', '\t', ',', ' '};
  const auto parts = [&](char separator) { return count_parts(header, separator) > 1; };
  for (const char separator : all)
    if (parts(separator) &&
        (row.empty() || count_parts(row, separator) == count_parts(header, separator)))
      return separator;
  const auto* const found = std::ranges::find_if(all, parts);
  return found == std::end(all) ? ',' : *found;
}

bool is_comment(std::string_view line) {
  if (!line.empty() && line[0] >= '0') return false;  // as nearly all
  const std::string_view text = trimmed(line);
  return text.starts_with('#') || text.starts_with("//");
}

NumberReader::Result NumberReader::read(std::string_view cell, double& x) {
  const Result result = parse(cell, x);
  if (result == Result::Text) return read_otherwise(cell, x);
  if (!comma_allowed_ || cell.find('.') == cell.npos) return result;
  if (point_ == ',') return Result::Text;
  point_ = '.';
  return result;
}

NumberReader::Result NumberReader::read_otherwise(std::string_view cell, double& x) {
  const bool comma = comma_allowed_ && point_ != '.' && std::ranges::count(cell, ',') == 1 &&
                     cell.find('.') == cell.npos;
  std::string usual(cell);
  for (char& c : usual) {
    if (comma && c == ',') c = '.';
    if (c == 'd' || c == 'D') c = 'e';
  }
  if (usual == cell || (point_ == ',' && cell.find('.') != cell.npos)) return Result::Text;
  const Result result = parse(usual, x);
  if (comma && result != Result::Text) point_ = ',';
  return result;
}

}  // namespace gradpsi
