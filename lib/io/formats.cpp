#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/io.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

constexpr std::array<TableFormat, 2> table = {{
    {".csv", read_csv, write_csv},
    {".vtu", nullptr, write_vtu},
}};

}  // namespace

std::span<const TableFormat> table_formats() { return table; }

Table read_table(const path& file, int part, int parts, const std::vector<std::string>& names) {
  const auto found = std::ranges::find(table, file.extension().string(), &TableFormat::ending);
  const bool readable = found != table.end() && found->read;
  return (readable ? *found : table.front()).read(file, part, parts, names);
}

void write_table(const path& file, const Table& values) {
  const std::string ending = file.extension().string();
  const auto found = std::ranges::find(table, ending, &TableFormat::ending);
  if (found != table.end()) return found->write(file, values);
  std::vector<std::string> valid;
  for (const TableFormat& format : table) valid.emplace_back(format.ending);
  throw_unknown("ending", ending, valid);
}

}  // namespace gradpsi
