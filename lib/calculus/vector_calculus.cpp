#include "gradpsi/vector_calculus.hpp"

#include <array>

#include "calculus/blocks.hpp"
#include "calculus/contract.hpp"
#include "matrix/pass.hpp"

namespace gradpsi {
namespace {

const VectorOperatorRow& row(VectorOperator what) {
  return vector_operator_rows[static_cast<int>(what)];
}

/// The number of dimensions in which so many matrices are what the operator takes.
int dimension(VectorOperator what, std::span<const SparseMatrix> parts) {
  std::string expected;
  for (int d = 1; d <= 3; ++d) {
    const Contraction& table = row(what).by_dimension[d - 1];
    if (table.results == 0) continue;
    if (table.matrices == std::ssize(parts)) return d;
    expected += (expected.empty() ? "" : d == 3 ? " or " : ", ") + std::to_string(table.matrices);
  }
  throw InvalidInput("the " + std::string(name(what)) + " takes " + expected + " matrices, not " +
                     std::to_string(parts.size()));
}

}  // namespace

std::span<const VectorOperator> vector_operators() {
  static constexpr auto all = [] {
    std::array<VectorOperator, vector_operator_count> result{};
    for (int k = 0; k < vector_operator_count; ++k) result[k] = static_cast<VectorOperator>(k);
    return result;
  }();
  return all;
}

std::string_view name(VectorOperator what) { return row(what).name; }

std::vector<std::string> components(VectorOperator what, int d) {
  if (d < 1 || d > 3) throw InvalidInput("there are 1 to 3 dimensions, not " + std::to_string(d));
  const int results = row(what).by_dimension[d - 1].results;
  const int directions = d == 2 && results == 1 ? 0 : row(what).directions;
  std::vector<std::string> names;
  if (results == 0) return names;
  if (directions == 0) return {""};
  const bool symmetric = results < d * d;
  for (int a = 0; a < d; ++a) {
    if (directions == 1) names.emplace_back(1, "xyz"[a]);
    for (int b = symmetric ? a : 0; directions == 2 && b < d; ++b)
      names.push_back({"xyz"[a], "xyz"[b]});
  }
  return names;
}

void multiply(VectorOperator what, std::span<const SparseMatrix> parts, const MatrixView& v,
              Result<Eigen::Dynamic> Y, int threads) {
  const int d = dimension(what, parts);
  const Contraction& table = row(what).by_dimension[d - 1];
  if (v.cols() != table.components)
    throw InvalidInput("the " + std::string(name(what)) + " in " + std::to_string(d) +
                       "D takes fields of " + std::to_string(table.components) +
                       " components, not " + std::to_string(v.cols()));
  for (const SparseMatrix& A : parts) check_product(A, v.rows(), threads);
  check_share_pattern(parts);
  check_apart(v.data(), Y.data());
  const SparseMatrix& first = parts.front();
  double* const result = Y.resized(first.rows(), table.results);
  ContractionArguments arguments{
      first.outerIndexPtr(), first.innerIndexPtr(), entries(first), {}, {}, {}};
  for (int m = 0; m < table.matrices; ++m) arguments.values[m] = parts[m].valuePtr();
  for (int c = 0; c < table.components; ++c) arguments.x[c] = v.col(c).data();
  const ContractionFunction contract =
      contraction_kernels(gathering_cpu()).of[static_cast<int>(what)][d - 1];
  parallel_rows(first, threads, [&](int begin, int end) {
    ContractionArguments part = arguments;
    for (int r = 0; r < table.results; ++r) part.y[r] = result + r * first.rows() + begin;
    contract(part, begin, end);
  });
}

SparseMatrix block_matrix(VectorOperator what, std::span<const SparseMatrix> parts, int threads) {
  const Contraction& table = row(what).by_dimension[dimension(what, parts) - 1];
  for (const SparseMatrix& A : parts) check_product(A, A.cols(), threads);
  check_share_pattern(parts);
  const Product* blocks[9][3] = {};  // by result and component
  for (int t = 0; t < table.count; ++t)
    blocks[table.terms[t].result][table.terms[t].component] = &table.terms[t];
  const int* const outer = parts.front().outerIndexPtr();
  return of_blocks(
      parts.front(), table.results, table.components,
      [&](int r, int c) { return blocks[r][c] != nullptr; },
      [&](int r, int c, int i, double* values) {
        const Product& term = *blocks[r][c];
        const double* const a = parts[term.matrix].valuePtr();
        for (int k = outer[i]; k < outer[i + 1]; ++k) *values++ = term.factor * a[k];
      },
      threads);
}

}  // namespace gradpsi
