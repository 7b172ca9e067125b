#pragma once

#include <filesystem>
#include <gradpsi/io.hpp>
#include <string>
#include <vector>

// The columns of the files that people have, by the names that are used here.

namespace gradpsi::apps {

/// What is told about a file's points before anything is computed from them, a sentence each.
using Notes = std::vector<std::string>;

/// Reads a table. Where no column is called x, those of other programs that mean the coordinates (X, x [m], Points:0,
/// pos_x) are renamed to x, y, z, and it is noted.
/// @param columns  "x=X,T=Temp [K]": new names of columns; "x,y,T": all names, of a file without a header; or empty
/// @param part     of `parts`, as read_table() takes them
/// @throws BadUsage      for `columns` that are neither
/// @throws InvalidInput  as read_table(); for a column that is not there, or a name that is taken
Table read_columns(const std::filesystem::path& file, const std::string& columns, Notes& notes,
                   int part = 0, int parts = 1);

}  // namespace gradpsi::apps
