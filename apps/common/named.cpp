#include "common/named.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <gradpsi/error.hpp>
#include <utility>

#include "common/cli.hpp"

namespace gradpsi::apps {

namespace {

/// What --columns says: all names, or some new ones.
struct Wishes {
  std::vector<std::string> all;
  std::vector<std::pair<std::string, std::string>> renamed;  // new, old
};

Wishes wishes(const std::string& list) {
  Wishes result;
  if (list.empty()) return result;
  for (const std::string& word : listed("--columns", list)) {
    const auto equals = word.find('=');
    if (equals == 0 || equals + 1 == word.size())
      throw BadUsage("--columns", "a name is missing in '" + list + "'");
    if (equals == word.npos)
      result.all.push_back(word);
    else
      result.renamed.emplace_back(word.substr(0, equals), word.substr(equals + 1));
  }
  if (!result.all.empty() && !result.renamed.empty())
    throw BadUsage("--columns",
                   "either all are NAME, of a file without a header, or all NAME=COLUMN");
  return result;
}

void rename(const std::string& old, const std::string& name, Table& table) {
  if (!table.has(old)) static_cast<void>(table.column(old));  // says which there are
  if (table.has(name)) throw InvalidInput("there is already a column '" + name + "'");
  *std::ranges::find(table.names, old) = name;
  for (TextColumn& text : table.texts)
    if (text.name == old) text.name = name;
}

/// Without a unit, in small letters.
std::string plain(std::string name) {
  name.resize(std::min(name.find_first_of("[("), name.size()));
  while (name.ends_with(' ')) name.pop_back();
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

/// The axis that a column's name means elsewhere; -1: none.
int meant_axis(const std::string& name) {
  static constexpr std::array before = {"", "pos_", "position_", "coord_", "coordinate_"};
  static constexpr std::array numbered = {"points", "position", "positions", "coordinates", "pos"};
  const std::string meant = plain(name);
  for (int a = 0; a < 3; ++a) {
    const std::string axis(1, "xyz"[a]), number(1, "012"[a]);
    for (const std::string stem : before)
      if (meant == stem + axis) return a;
    for (const char* const end : {"-coordinate", "_coordinate", " coordinate"})
      if (meant == axis + end) return a;
    for (const std::string stem : numbered)
      if (meant == stem + ':' + number || meant == stem + '_' + number) return a;
  }
  return -1;
}

void recognise(Table& table, Notes& notes) {
  if (table.has("x")) return;
  std::array<std::vector<std::string>, 3> candidates;
  for (const std::string& name : table.names)
    if (const int a = meant_axis(name); a >= 0) candidates[a].push_back(name);
  std::string taken, as;
  for (std::size_t a = 0; a < 3 && candidates[a].size() == 1; ++a) {
    const std::string axis(1, "xyz"[a]), &name = candidates[a].front();
    if (name == axis) continue;
    rename(name, axis, table);
    taken += (taken.empty() ? "'" : ", '") + name + "'";
    as += (as.empty() ? "" : ", ") + axis;
  }
  if (!taken.empty())
    notes.push_back((as.size() == 1 ? "column " : "columns ") + taken +
                    (as.size() == 1 ? " is" : " are") + " taken as " + as);
}

}  // namespace

Table read_columns(const std::filesystem::path& file, const std::string& columns, Notes& notes,
                   int part, int parts) {
  const Wishes wanted = wishes(columns);
  Table table = read_table(file, part, parts, wanted.all);
  for (const auto& [name, old] : wanted.renamed) rename(old, name, table);
  recognise(table, notes);
  return table;
}

}  // namespace gradpsi::apps
