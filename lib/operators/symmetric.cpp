#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "gradpsi/assemble.hpp"
#include "gradpsi/error.hpp"
#include "operators/pattern.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 1024;

void check(const Scheme& scheme, const Operator& op) {
  if (symmetry(scheme) == Symmetry::None)
    throw InvalidInput(name(scheme) + " is not symmetric with any support: only schemes without " +
                       "correction (zoc) are");
  // A gradient along a surface has as many components as the points have coordinates.
  if (op.axes.empty() || op.axes.size() > components(scheme.derivative, 3).size())
    throw InvalidInput("an operator of " + std::to_string(op.axes.size()) +
                       " matrices is none of " + name(scheme));
  const Eigen::Index n = op.volumes.size();
  for (const SparseMatrix& A : op.axes)
    if (A.rows() != n || A.cols() != n || std::ssize(op.rows.outcome) != n || !op.points.empty())
      throw InvalidInput("symmetric supports need the rows of all " + std::to_string(n) +
                         " points, not " + std::to_string(A.rows()));
}

/// A matrix beside its transpose, row by row.
struct Mirrored {
  const SparseMatrix& A;
  SparseMatrix transpose = A.transpose();

  /// Calls visit(j, a_ij, a_ji) for the columns that either has in row i, ascending.
  template <class Visit>
  void for_each_in(int i, const Visit& visit) const {
    SparseMatrix::InnerIterator own(A, i), other(transpose, i);
    while (own || other) {
      const bool from_own = own && !(other && other.col() < own.col());
      const auto j = static_cast<int>(from_own ? own.col() : other.col());
      double ij = 0, ji = 0;
      if (own && own.col() == j) ij = own.value(), ++own;
      if (other && other.col() == j) ji = other.value(), ++other;
      visit(j, ij, ji);
    }
  }
};

/// A matrix with room for what either of two mirror images has.
SparseMatrix union_pattern(const Mirrored& both, int threads) {
  const auto n = static_cast<int>(both.A.rows());
  SparseMatrix result(n, n);
  int* const outer = result.outerIndexPtr();
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      both.for_each_in(i, [&](int, double, double) { ++outer[i + 1]; });
  });
  std::int64_t entries = 0;
  for (int i = 0; i < n; ++i) {
    check_entries(entries += outer[i + 1]);
    outer[i + 1] = static_cast<int>(entries);
  }
  resize_in_large_pages(result, outer[n]);
  return result;
}

/// Off the diagonal (a_ij + sign a_ji omega_j / omega_i) / 2, a_ij where row j is zero; on it their sum times
/// `diagonal_sign`.
SparseMatrix mean_of_both(const SparseMatrix& A, double sign, double diagonal_sign,
                          const Operator& op, int threads) {
  const Mirrored both{A};
  SparseMatrix result = union_pattern(both, threads);
  const auto is_zero = [&](int i) { return op.rows.outcome[i] == RowOutcome::Zero; };
  parallel_chunks(static_cast<int>(A.rows()), rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      int at = result.outerIndexPtr()[i], diagonal = at;
      double sum = 0;
      both.for_each_in(i, [&](int j, double ij, double ji) {
        const double mirrored = sign * ji * (op.volumes[j] / op.volumes[i]);
        const double mean = is_zero(i) || j == i ? 0 : is_zero(j) ? ij : (ij + mirrored) / 2;
        if (j == i) diagonal = at;
        result.innerIndexPtr()[at] = j;
        result.valuePtr()[at++] = mean;
        sum += mean;
      });
      result.valuePtr()[diagonal] = 0 + diagonal_sign * sum;
    }
  });
  return result;
}

/// Points that have a weight in row i, in one matrix at least.
int weights(const Operator& op, int i) {
  int count = 0;
  for (int k = op.matrix().outerIndexPtr()[i]; k < op.matrix().outerIndexPtr()[i + 1]; ++k)
    count += op.matrix().innerIndexPtr()[k] != i &&
             std::ranges::any_of(op.axes, [&](const auto& A) { return A.valuePtr()[k] != 0; });
  return count;
}

}  // namespace

Operator with_symmetric_supports(const Scheme& scheme, Operator op, int threads) {
  checked_threads(threads);
  check(scheme, op);
  const double sign = symmetry(scheme) == Symmetry::Symmetric ? 1 : -1;
  for (SparseMatrix& A : op.axes) A = mean_of_both(A, sign, recipe(scheme).diagonal, op, threads);
  for (int i = 0; i < op.rows.neighbours.size(); ++i)
    if (op.rows.outcome[i] != RowOutcome::Zero) op.rows.neighbours[i] = weights(op, i);
  return op;
}

}  // namespace gradpsi
