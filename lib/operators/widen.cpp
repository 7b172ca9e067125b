#include "operators/widen.hpp"

#include <algorithm>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "operators/degenerate.hpp"
#include "operators/row.hpp"
#include "operators/surface.hpp"
#include "search/check.hpp"
#include "search/search.hpp"

namespace gradpsi {
namespace {

/// A row with more neighbours than there were to begin with.
struct WidenedRow {
  std::vector<int> columns;    // with the diagonal; empty: could not be solved
  std::vector<double> values;  // output by output
  Eigen::RowVector3d normal;   // on a surface
};
using WidenedRows = std::map<int, WidenedRow>;

template <class AnyRow>
WidenedRow widened_row(AnyRow& row, std::span<const int> neighbours, int i) {
  WidenedRow result;
  result.columns.assign(neighbours.begin(), neighbours.end());
  result.columns.insert(std::ranges::lower_bound(result.columns, i), i);
  const std::size_t entries = result.columns.size(), outputs = row.outputs();
  result.values.resize(outputs * entries);
  for (std::size_t o = 0; o < outputs; ++o)
    row.write(neighbours, i, static_cast<int>(o), result.values.data() + o * entries);
  if constexpr (std::is_same_v<AnyRow, SurfaceRow>) result.normal = row.normal();
  return result;
}

/// Rows that were tried with larger supports.
struct Attempt {
  DenseVector supports;
  RowReport report;
  std::vector<WidenedRow> rows;
};

template <class AnyRow>
Attempt attempt(const Equations& equations, const Cloud& cloud, const DenseVector& volumes,
                const Surroundings& neighbours, const std::vector<int>& points,
                const DenseVector& supports, const AssemblyOptions& options) {
  const int count = static_cast<int>(points.size());
  const Neighbours near = neighbours(points, supports);
  Attempt result{supports, empty_report(count), std::vector<WidenedRow>(count)};
  parallel_chunks(count, 16, options.threads,
                  [&, row = AnyRow(options.kernel)](int begin, int end) mutable {
                    for (int z = begin; z < end; ++z) {
                      row.gather(cloud, near.of(z), supports[z], volumes, points[z]);
                      solve_row(row, {equations}, result.report, z);
                      result.report.neighbours[z] = near.count(z);
                      if (result.report.outcome[z] != RowOutcome::Zero)
                        result.rows[z] = widened_row(row, near.of(z), points[z]);
                    }
                  });
  return result;
}

/// Moves what could be solved out of the attempt at `zero`, rows of the operator, and reports it; returns
/// the rows that are still zero.
std::vector<int> take(Attempt& attempt, const std::vector<int>& zero, RowReport& report,
                      WidenedRows& solved) {
  std::vector<int> still;
  for (int z = 0; z < std::ssize(zero); ++z) {
    const int k = zero[z];
    if (attempt.rows[z].columns.empty()) {
      still.push_back(k);
      continue;
    }
    report.neighbours[k] = attempt.report.neighbours[z];
    report.reciprocal_condition[k] = attempt.report.reciprocal_condition[z];
    report.outcome[k] = RowOutcome::Widened;
    report.degree[k] = attempt.report.degree[z];
    report.supports[k] = attempt.supports[z];
    solved.emplace(k, std::move(attempt.rows[z]));
  }
  return still;
}

WidenedRows widened_rows(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
                         const AssemblyOptions& options, Operator& op) {
  constexpr double step = 1.2;
  const Equations asked = equations(scheme, row_dimension(cloud, options));
  std::vector<int> zero;
  for (int k = 0; k < rows.count; ++k)
    if (op.rows.outcome[k] == RowOutcome::Zero) zero.push_back(k);
  WidenedRows solved;
  if (zero.empty()) return solved;
  const Surroundings neighbours = surroundings(cloud, op.rows.supports.maxCoeff(), options.threads);
  for (double factor = step; factor <= widest && !zero.empty(); factor *= step) {
    std::vector<int> points;
    DenseVector supports(std::ssize(zero));
    for (const int k : zero) {
      supports[std::ssize(points)] = std::min(factor * op.rows.supports[k], largest_support(cloud));
      points.push_back(rows.point(k));
    }
    Attempt tried =
        on_surface(cloud, options)
            ? attempt<SurfaceRow>(asked, cloud, op.volumes, neighbours, points, supports, options)
            : dispatch(cloud.dimension(), [&](auto d) {
                return attempt<Row<d>>(asked, cloud, op.volumes, neighbours, points, supports,
                                       options);
              });
    zero = take(tried, zero, op.rows, solved);
  }
  return solved;
}

/// The matrix with those rows in place of its own.
SparseMatrix with_rows(const SparseMatrix& matrix, const WidenedRows& replaced, int axis) {
  std::int64_t entries = matrix.nonZeros();
  for (const auto& [k, row] : replaced)
    entries += static_cast<std::int64_t>(row.columns.size()) - matrix.row(k).nonZeros();
  check_entries(entries);
  SparseMatrix result(matrix.rows(), matrix.cols());
  result.resizeNonZeros(entries);
  int* column = result.innerIndexPtr();
  double* value = result.valuePtr();
  for (int k = 0; k < matrix.rows(); ++k) {
    if (const auto found = replaced.find(k); found != replaced.end()) {
      const auto& [columns, values, normal] = found->second;
      column = std::ranges::copy(columns, column).out;
      value = std::copy_n(values.begin() + axis * std::ssize(columns), columns.size(), value);
    } else {
      const int begin = matrix.outerIndexPtr()[k], end = matrix.outerIndexPtr()[k + 1];
      column = std::copy(matrix.innerIndexPtr() + begin, matrix.innerIndexPtr() + end, column);
      value = std::copy(matrix.valuePtr() + begin, matrix.valuePtr() + end, value);
    }
    result.outerIndexPtr()[k + 1] = static_cast<int>(value - result.valuePtr());
  }
  return result;
}

}  // namespace

void widen(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
           const AssemblyOptions& options, Operator& op) {
  const WidenedRows widened = widened_rows(scheme, cloud, rows, options, op);
  if (widened.empty()) return;
  for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
    op.axes[axis] = with_rows(op.axes[axis], widened, static_cast<int>(axis));
  if (!on_surface(cloud, options)) return;
  for (const auto& [k, row] : widened) op.normals.row(k) = row.normal;
}

}  // namespace gradpsi
