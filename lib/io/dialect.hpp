#pragma once

#include <string>
#include <string_view>

#include "io/text.hpp"

// How files of text write tables.

namespace gradpsi {

/// A cell in quotes; the line continues behind it and its separator.
struct QuotedCell {
  std::string_view inside;  // with quotes as they stand there, each twice
  bool closed, last;
};
QuotedCell take_quoted(std::string_view& line, char separator);

/// What stands in quotes, "" as one.
std::string unquoted(std::string_view inside);

/// Calls visit(cell, quoted) for each cell of a line; the separator ' ' is any run of blanks and tabs.
template <class Visit>
void for_each_cell(std::string_view line, char separator, const Visit& visit) {
  const bool by_blanks = separator == ' ';
  line = by_blanks ? trimmed(line) : line;
  for (;;) {
    std::string_view rest = line;
    if (!rest.empty() && (rest[0] == ' ' || rest[0] == '\t')) rest = trimmed(rest);
    if (!rest.empty() && rest[0] == '"') {
      if (const QuotedCell cell = take_quoted(rest, separator); cell.closed) {
        visit(cell.inside, true);
        if (cell.last) return;
        line = rest;
        continue;
      }
    }
    const auto end = by_blanks ? line.find_first_of(" \t") : line.find(separator);
    visit(trimmed(line.substr(0, end)), false);
    if (end == line.npos) return;
    line = by_blanks ? trimmed(line.substr(end)) : line.substr(end + 1);
  }
}

int count_cells(std::string_view line, char separator);

/// What parts the cells of a header and of the row below it, of ; tab , and blanks the first that gives both as
/// many; `row` may be empty.
char separator_of(std::string_view header, std::string_view row);

/// Whether a line is a remark: it begins with # or //.
bool is_comment(std::string_view line);

/// Reads the numbers of a file: with a decimal point, or where commas do not part cells with a decimal comma,
/// whichever comes first; exponents with e, E, d or D.
class NumberReader {
 public:
  explicit NumberReader(char separator) : comma_allowed_(separator != ',') {}

  enum class Result { Number, Text, BeyondDouble };
  Result read(std::string_view cell, double& x);

 private:
  Result read_otherwise(std::string_view cell, double& x);

  bool comma_allowed_;
  char point_ = 0;  // '.' or ',' once one was met
};

}  // namespace gradpsi
