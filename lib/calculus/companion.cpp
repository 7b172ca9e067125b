#include <string>
#include <vector>

#include "base/copy_pattern.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/vector_calculus.hpp"
#include "matrix/pass.hpp"

namespace gradpsi {
namespace {

void check(const Operator& gradient, int threads) {
  if (gradient.axes.empty()) throw InvalidInput("the gradient has no matrices");
  const Eigen::Index n = gradient.volumes.size();
  for (const SparseMatrix& A : gradient.axes) {
    check_product(A, A.cols(), threads);
    if (A.rows() != n || A.cols() != n || !gradient.points.empty())
      throw InvalidInput("a conservative companion needs the rows of all " + std::to_string(n) +
                         " points, not " + std::to_string(A.rows()));
  }
  check_share_pattern(gradient.axes);
}

/// Gives `result` the transpose's pattern, its values left as they come.
/// @return  where each of its entries is in A
std::vector<int> set_transposed_pattern(const SparseMatrix& A, SparseMatrix& result) {
  const auto n = static_cast<int>(A.rows());
  result.resize(n, n);
  resize_in_large_pages(result, entries(A));
  std::vector<int> from(A.nonZeros());
  int* const outer = result.outerIndexPtr();
  for (int k = 0; k < entries(A); ++k) ++outer[A.innerIndexPtr()[k] + 1];
  for (int j = 0; j < n; ++j) outer[j + 1] += outer[j];
  std::vector<int> next(outer, outer + n);
  for (int i = 0; i < n; ++i)
    for (int k = A.outerIndexPtr()[i]; k < A.outerIndexPtr()[i + 1]; ++k) {
      const int at = next[A.innerIndexPtr()[k]]++;
      result.innerIndexPtr()[at] = i;
      from[at] = k;
    }
  return from;
}

}  // namespace

std::vector<SparseMatrix> conservative_companion(const Operator& gradient, int threads) {
  check(gradient, threads);
  std::vector<SparseMatrix> result(gradient.axes.size());
  const std::vector<int> from = set_transposed_pattern(gradient.matrix(), result.front());
  for (std::size_t a = 1; a < result.size(); ++a) copy_pattern(result[a], result.front(), threads);
  const DenseVector& omega = gradient.volumes;
  parallel_rows(result.front(), threads, [&](int begin, int end) {
    for (std::size_t a = 0; a < result.size(); ++a)
      for (int i = begin; i < end; ++i)
        for (int k = result[a].outerIndexPtr()[i]; k < result[a].outerIndexPtr()[i + 1]; ++k)
          result[a].valuePtr()[k] = -gradient.axes[a].valuePtr()[from[k]] *
                                    (omega[result[a].innerIndexPtr()[k]] / omega[i]);
  });
  return result;
}

}  // namespace gradpsi
