#include "io/table.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "gradpsi/table.hpp"

namespace gradpsi {
namespace {

Eigen::Index place_of(std::string_view name, const Table& table) {
  const auto found = std::ranges::find(table.names, name);
  if (found == table.names.end()) throw_unknown("column", name, table.names);
  return found - table.names.begin();
}

/// Whether a column or a vector has that name.
bool taken(std::string_view name, const Table& table) {
  return table.has(name) ||
         std::ranges::find(table.vectors, name, &TableVector::name) != table.vectors.end();
}

void check_length(std::string_view name, const VectorView& column, const Table& table) {
  if (column.size() != table.values.rows())
    throw InvalidInput("column '" + std::string(name) + "' has " + std::to_string(column.size()) +
                       " entries, the table has " + std::to_string(table.values.rows()) + " rows");
}

}  // namespace

bool Table::has(std::string_view name) const {
  return std::ranges::find(names, name) != names.end();
}

const TextColumn* Table::text(std::string_view name) const {
  const auto found = std::ranges::find(texts, name, &TextColumn::name);
  return found == texts.end() ? nullptr : &*found;
}

DenseVector Table::column(std::string_view name) const {
  const Eigen::Index place = place_of(name, *this);
  const TextColumn* const cells = text(name);
  if (cells && !cells->unread.empty()) throw InvalidInput(cells->unread);
  return values.col(place);
}

void Table::set(std::string_view name, const VectorView& column) {
  check_length(name, column, *this);
  values.col(place_of(name, *this)) = column;
  std::erase_if(texts, [&](const TextColumn& text) { return text.name == name; });
}

void Table::add(const std::string& name, const VectorView& column) {
  if (taken(name, *this)) throw InvalidInput("there is already a column '" + name + "'");
  if (names.empty()) values.resize(column.size(), 0);
  check_length(name, column, *this);
  std::vector<std::string> more = names;  // names and values change together or not at all
  more.push_back(name);
  values.conservativeResize(Eigen::NoChange, values.cols() + 1);
  names.swap(more);
  values.rightCols<1>() = column;
}

void Table::add_vector(const std::string& name, const std::array<std::string, 3>& columns) {
  if (taken(name, *this)) throw InvalidInput("there is already a column '" + name + "'");
  for (const std::string& column : columns)
    if (!column.empty()) place_of(column, *this);
  vectors.push_back({name, columns});
}

Table Table::select(const std::vector<int>& rows) const {
  Table result{names, values(rows, Eigen::all), vectors, texts};
  for (std::size_t k = 0; k < texts.size(); ++k) {
    result.texts[k].cells.clear();
    for (const int row : rows) result.texts[k].cells.push_back(texts[k].cells[row]);
  }
  return result;
}

Cloud make_cloud(const Table& table, CloudOptions options) {
  const auto dimension = std::ranges::count_if(axis_names, [&](auto a) { return table.has(a); });
  Positions x(table.values.rows(), std::max<std::ptrdiff_t>(dimension, 1));
  // With k coordinates these are the first k, so that a z without y is an unknown column y.
  for (Eigen::Index a = 0; a < x.cols(); ++a) {
    const DenseVector column = table.column(axis_names[a]);
    if (column.size() > 0) x.col(a) = column;  // without points there is no memory to point into
  }
  if (table.has("volume")) options.volumes = table.column("volume");
  return Cloud(std::move(x), std::move(options));
}

Cloud read_cloud(const std::filesystem::path& file) { return make_cloud(read_csv(file)); }

}  // namespace gradpsi
