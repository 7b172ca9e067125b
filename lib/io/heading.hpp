#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/file.hpp"

// What stands above the rows of a file.

namespace gradpsi {

struct Line {
  std::string text, place;
  std::int64_t begin;  // where in the file
};

/// The first lines: of those that are no comments three, and the last comment before them.
struct Beginning {
  std::vector<Line> lines;
  std::optional<Line> comment;
};

Beginning read_beginning(Lines& lines, const std::filesystem::path& file);

struct Head {
  std::vector<std::string> names;
  char separator = ',';
  bool ends_in_separator = false;  // rows, too, have nothing behind their last separator
};

/// The header, taken out of the beginning, whose lines are rows then.
/// @param names  of a file without a header
/// @throws InvalidInput  if there is none and no names are given, or both are; for names that cannot be
Head take_head(Beginning& beginning, const std::vector<std::string>& names);

}  // namespace gradpsi
