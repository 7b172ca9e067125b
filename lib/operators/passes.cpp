#include "operators/passes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "operators/degenerate.hpp"
#include "operators/pattern.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 256;

/// The rows' points and those that the gradient's rows there have, ascending.
std::vector<int> points_in_reach(const Scheme& gradient, const std::vector<int>& rows,
                                 const Cloud& cloud, const Neighbours& near,
                                 const AssemblyOptions& options) {
  std::vector<int> reached = rows;
  if (options.on_degenerate == OnDegenerate::Widen) {
    const SparseMatrix widened = assemble(gradient, cloud, near, options).matrix();
    reached.insert(reached.end(), widened.innerIndexPtr(),
                   widened.innerIndexPtr() + widened.nonZeros());
  } else {
    for (const int i : rows) reached.insert(reached.end(), near.of(i).begin(), near.of(i).end());
  }
  std::ranges::sort(reached);
  reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
  return reached;
}

/// Rows of a sum of squares, sum_a G_a G_a, of matrices that share their pattern; a copy has memory of its own.
class SquaredRows {
 public:
  /// @param row_of  where the matrices have a point's row
  SquaredRows(const std::vector<SparseMatrix>& G, const std::vector<int>& row_of)
      : G_(G), row_of_(row_of), sum_(G.front().cols()), reached_in_(G.front().cols()) {}

  /// Computes a point's row.
  void add_up(int i) {
    columns_.clear();
    ++turn_;
    for_entries(row_of_[i], [&](int j, int ij) {
      for_entries(row_of_[j], [&](int k, int jk) {
        if (std::exchange(reached_in_[k], turn_) != turn_) {
          columns_.push_back(k);
          sum_[k] = 0;
        }
        for (const SparseMatrix& G : G_) sum_[k] += G.valuePtr()[ij] * G.valuePtr()[jk];
      });
    });
    std::ranges::sort(columns_);
  }
  const std::vector<int>& columns() const { return columns_; }
  double value(int column) const { return sum_[column]; }

 private:
  template <class Visit>
  void for_entries(int row, const Visit& visit) const {
    const SparseMatrix& G = G_.front();
    for (int n = G.outerIndexPtr()[row]; n < G.outerIndexPtr()[row + 1]; ++n)
      visit(G.innerIndexPtr()[n], n);
  }

  const std::vector<SparseMatrix>& G_;
  const std::vector<int>& row_of_;
  std::vector<double> sum_;
  std::vector<int> reached_in_, columns_;
  int turn_ = 0;
};

SparseMatrix squared(const std::vector<SparseMatrix>& G, const std::vector<int>& row_of,
                     const ChosenRows& rows, int threads) {
  SparseMatrix result(rows.count, G.front().cols());
  int* const outer = result.outerIndexPtr();
  const auto for_rows = [&](const auto& use) {
    parallel_chunks(rows.count, rows_per_chunk, threads,
                    [&, row = SquaredRows(G, row_of)](int begin, int end) mutable {
                      for (int k = begin; k < end; ++k) {
                        row.add_up(rows.point(k));
                        use(k, row);
                      }
                    });
  };
  for_rows([&](int k, const SquaredRows& row) {
    outer[k + 1] = static_cast<int>(row.columns().size());
  });
  std::int64_t entries = 0;
  for (int k = 0; k < rows.count; ++k) {
    check_entries(entries += outer[k + 1]);
    outer[k + 1] = static_cast<int>(entries);
  }
  resize_in_large_pages(result, outer[rows.count]);
  // Products cancel: the diagonal's would leave a sum that is small beside them, not beside the row.
  for_rows([&](int k, const SquaredRows& row) {
    int at = outer[k], diagonal = at;
    double others = 0;
    for (const int j : row.columns()) {
      if (j == rows.point(k))
        diagonal = at;
      else
        others += row.value(j);
      result.innerIndexPtr()[at] = j;
      result.valuePtr()[at++] = row.value(j);
    }
    result.valuePtr()[diagonal] = 0 - others;
  });
  return result;
}

/// Reports row k as the worst of the gradient's rows that it is made of; a row that one is missing of, or
/// whose products are no numbers, is zero.
void report(const Operator& gradient, const std::vector<int>& row_of, int i, int k, Operator& op) {
  const RowReport& made_of = gradient.rows;
  RowReport& rows = op.rows;
  const int own = row_of[i];
  rows.supports[k] = made_of.supports[own];
  rows.outcome[k] = made_of.outcome[own];
  rows.reciprocal_condition[k] = made_of.reciprocal_condition[own];
  rows.degree[k] = made_of.degree[own];
  SparseMatrix& A = op.axes.front();
  rows.neighbours[k] = A.outerIndexPtr()[k + 1] - A.outerIndexPtr()[k] - 1;
  double* const begin = A.valuePtr() + A.outerIndexPtr()[k];
  double* const end = A.valuePtr() + A.outerIndexPtr()[k + 1];
  bool zero = rows.outcome[k] == RowOutcome::Zero ||
              !std::all_of(begin, end, [](double a) { return std::isfinite(a); });
  for (SparseMatrix::InnerIterator entry(gradient.axes.front(), own); entry; ++entry) {
    const int j = row_of[entry.col()];
    if (rows.outcome[k] == RowOutcome::AsAsked) rows.outcome[k] = made_of.outcome[j];
    rows.reciprocal_condition[k] =
        std::min(rows.reciprocal_condition[k], made_of.reciprocal_condition[j]);
    rows.degree[k] = std::min(rows.degree[k], made_of.degree[j]);
    zero = zero || made_of.outcome[j] == RowOutcome::Zero;
  }
  if (!zero) return;
  rows.outcome[k] = RowOutcome::Zero;
  rows.degree[k] = -1;
  std::fill(begin, end, 0);
}

}  // namespace

Operator two_passes(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                    const AssemblyOptions& options) {
  const ChosenRows rows = chosen_rows(options, cloud);
  AssemblyOptions of_gradient = options;
  if (options.on_degenerate == OnDegenerate::Fail) of_gradient.on_degenerate = OnDegenerate::Zero;
  const Scheme after = recipe(scheme).after;
  if (rows.chosen) of_gradient.rows = points_in_reach(after, *rows.chosen, cloud, near, options);
  const Operator gradient = assemble(after, cloud, near, of_gradient);
  std::vector<int> row_of(cloud.size(), -1);
  const ChosenRows reached = chosen_rows(of_gradient, cloud);
  for (int k = 0; k < reached.count; ++k) row_of[reached.point(k)] = k;

  Operator op;
  op.volumes = gradient.volumes;
  op.rows = empty_report(rows.count);
  op.axes.push_back(squared(gradient.axes, row_of, rows, options.threads));
  if (rows.chosen) op.points = *rows.chosen;
  if (gradient.normals.size() > 0) op.normals.resize(rows.count, 3);
  for (int k = 0; k < rows.count; ++k) {
    const int i = rows.point(k);
    report(gradient, row_of, i, k, op);
    if (op.rows.outcome[k] == RowOutcome::Zero) op.rows.supports[k] = near.support(i);
    if (op.normals.size() > 0) op.normals.row(k) = gradient.normals.row(row_of[i]);
  }
  if (options.on_degenerate == OnDegenerate::Fail) throw_if_degenerate(scheme, cloud, rows, op);
  return op;
}

}  // namespace gradpsi
