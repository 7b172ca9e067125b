#include "tolerance/row_store.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "operators/degenerate.hpp"
#include "operators/pattern.hpp"

namespace gradpsi {

RowStore::RowStore(int points, int outputs)
    : places_(points), values_(outputs), rows_(empty_report(points)) {
  rows_.schemes.resize(points);
  rows_.errors.setConstant(points, std::numeric_limits<double>::infinity());
  for (int i = 0; i < points; ++i) columns_.push_back(i);
  for (std::vector<double>& values : values_) values.assign(points, 0);
  for (int i = 0; i < points; ++i) drop(i);
}

void RowStore::drop(int i) {
  places_[i] = {static_cast<std::size_t>(i), 1};
  rows_.neighbours[i] = 0;
  rows_.supports[i] = rows_.reciprocal_condition[i] = 0;
  rows_.outcome[i] = RowOutcome::Zero;
  rows_.degree[i] = -1;
  rows_.schemes[i].reset();
  rows_.errors[i] = std::numeric_limits<double>::infinity();
}

void RowStore::take(const Operator& op, int k, const Scheme& scheme, double error) {
  const int i = op.point(k), begin = op.matrix().outerIndexPtr()[k],
            end = op.matrix().outerIndexPtr()[k + 1];
  if (places_[i].begin >= places_.size()) unused_ += places_[i].count;
  if (unused_ > places_.size() + columns_.size() / 2) tidy();
  places_[i] = {columns_.size(), end - begin};
  columns_.insert(columns_.end(), op.matrix().innerIndexPtr() + begin,
                  op.matrix().innerIndexPtr() + end);
  for (std::size_t o = 0; o < values_.size(); ++o)
    values_[o].insert(values_[o].end(), op.axes[o].valuePtr() + begin, op.axes[o].valuePtr() + end);
  rows_.neighbours[i] = op.rows.neighbours[k];
  rows_.supports[i] = op.rows.supports[k];
  rows_.reciprocal_condition[i] = op.rows.reciprocal_condition[k];
  rows_.outcome[i] = op.rows.outcome[k];
  rows_.degree[i] = op.rows.degree[k];
  rows_.schemes[i] = scheme;
  rows_.errors[i] = error;
}

/// Gives up what no row needs.
void RowStore::tidy() {
  std::vector<int> columns(columns_.begin(), columns_.begin() + std::ssize(places_));
  std::vector<std::vector<double>> values(values_.size());
  for (std::vector<double>& of_output : values) of_output.assign(places_.size(), 0);
  for (Place& place : places_) {
    if (place.begin < places_.size()) continue;
    const auto begin = static_cast<std::ptrdiff_t>(place.begin);
    place.begin = columns.size();
    columns.insert(columns.end(), columns_.begin() + begin, columns_.begin() + begin + place.count);
    for (std::size_t o = 0; o < values.size(); ++o)
      values[o].insert(values[o].end(), values_[o].begin() + begin,
                       values_[o].begin() + begin + place.count);
  }
  columns_ = std::move(columns);
  values_ = std::move(values);
  unused_ = 0;
}

Operator RowStore::operator_of(const DenseVector& volumes) const {
  std::int64_t entries = 0;
  for (const Place& place : places_) entries += place.count;
  check_entries(entries);
  const auto n = static_cast<int>(places_.size());
  Operator op;
  for (const std::vector<double>& values : values_) {
    SparseMatrix matrix(n, n);
    matrix.resizeNonZeros(entries);
    int at = 0;
    for (int i = 0; i < n; ++i) {
      const auto [begin, count] = places_[i];
      std::copy_n(columns_.begin() + static_cast<std::ptrdiff_t>(begin), count,
                  matrix.innerIndexPtr() + at);
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(begin), count,
                  matrix.valuePtr() + at);
      matrix.outerIndexPtr()[i + 1] = at += count;
    }
    op.axes.push_back(std::move(matrix));
  }
  op.volumes = volumes;
  op.rows = rows_;
  return op;
}

}  // namespace gradpsi
