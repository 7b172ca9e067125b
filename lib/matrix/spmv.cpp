#include "gradpsi/spmv.hpp"

#include <algorithm>
#include <string>

#include "matrix/pass.hpp"
#include "matrix/products.hpp"

namespace gradpsi {
namespace {

template <class Matrix, class Value>
void run(const Matrix& A, ProductFunction<Value> function, const ProductArguments<Value>& arguments,
         int results, int threads) {
  parallel_rows(A, threads, [&](int begin, int end) {
    ProductArguments<Value> part = arguments;
    for (int r = 0; r < results; ++r) part.y[r] += begin;
    function(part, begin, end);
  });
}

/// One beyond the last row that rows begin to end of an upper triangle and their mirror images add to.
int reach_of_rows(const SparseMatrix& upper, int begin, int end) {
  const int* const outer = upper.outerIndexPtr();
  const int* const inner = upper.innerIndexPtr();
  int reach = end;
  for (int i = begin; i < end; ++i) {
    if (outer[i] == outer[i + 1]) continue;
    if (inner[outer[i]] < i)
      throw InvalidInput("row " + std::to_string(i) + " has an entry below the diagonal");
    reach = std::max(reach, inner[outer[i + 1] - 1] + 1);
  }
  return reach;
}

/// Adds what rows begin to end of an upper triangle and their mirror images contribute to A x; sum[0] is
/// of row `begin`.
void add_symmetric_product(const SparseMatrix& upper, int begin, int end, const double* x,
                           double* sum) {
  const int* const outer = upper.outerIndexPtr();
  const int* const inner = upper.innerIndexPtr();
  const double* const a = upper.valuePtr();
  for (int i = begin; i < end; ++i) {
    const double xi = x[i];
    double own = 0;
    int k = outer[i];
    if (k < outer[i + 1] && inner[k] == i) own = a[k++] * xi;
    for (; k < outer[i + 1]; ++k) {
      own += a[k] * x[inner[k]];
      sum[inner[k] - begin] += a[k] * xi;
    }
    sum[i - begin] += own;
  }
}

}  // namespace

void multiply(const SparseMatrix& A, const VectorView& x, Result<1> y, int threads) {
  check_product(A, x.size(), threads);
  check_apart(x.data(), y.data());
  double* const result = y.resized(A.rows());
  run<SparseMatrix, double>(
      A, product_kernels(gathering_cpu()).vectors[0],
      {A.outerIndexPtr(), A.innerIndexPtr(), entries(A), {A.valuePtr()}, {x.data()}, {result}}, 1,
      threads);
}

void multiply(const SparseMatrix& A, const MatrixView& X, Result<Eigen::Dynamic> Y, int threads) {
  check_product(A, X.rows(), threads);
  check_apart(X.data(), Y.data());
  double* const result = Y.resized(A.rows(), X.cols());
  for (Eigen::Index first = 0; first < X.cols(); first += 4) {
    const int count = static_cast<int>(std::min<Eigen::Index>(4, X.cols() - first));
    ProductArguments<double> arguments{
        A.outerIndexPtr(), A.innerIndexPtr(), entries(A), {A.valuePtr()}, {}, {}};
    for (int c = 0; c < count; ++c) {
      arguments.x[c] = X.col(first + c).data();
      arguments.y[c] = result + (first + c) * A.rows();
    }
    run(A, product_kernels(gathering_cpu()).vectors[count - 1], arguments, count, threads);
  }
}

void multiply(std::span<const SparseMatrix> axes, const VectorView& x, Result<Eigen::Dynamic> Y,
              int threads) {
  if (axes.empty()) throw InvalidInput("there is no matrix to multiply");
  const SparseMatrix& first = axes.front();
  for (const SparseMatrix& A : axes) check_product(A, x.size(), threads);
  check_share_pattern(axes);
  check_apart(x.data(), Y.data());
  double* const result = Y.resized(first.rows(), std::ssize(axes));
  for (std::size_t begin = 0; begin < axes.size(); begin += 3) {
    const int count = static_cast<int>(std::min<std::size_t>(3, axes.size() - begin));
    ProductArguments<double> arguments{
        first.outerIndexPtr(), first.innerIndexPtr(), entries(first), {}, {x.data()}, {}};
    for (int a = 0; a < count; ++a) {
      arguments.values[a] = axes[begin + a].valuePtr();
      arguments.y[a] = result + static_cast<Eigen::Index>(begin + a) * first.rows();
    }
    run(first, product_kernels(gathering_cpu()).matrices[count - 1], arguments, count, threads);
  }
}

void multiply(const SingleSparseMatrix& A, const VectorView& x, Result<1> y, int threads) {
  check_product(A, x.size(), threads);
  check_apart(x.data(), y.data());
  double* const result = y.resized(A.rows());
  run<SingleSparseMatrix, float>(
      A, product_kernels(gathering_cpu()).single,
      {A.outerIndexPtr(), A.innerIndexPtr(), entries(A), {A.valuePtr()}, {x.data()}, {result}}, 1,
      threads);
}

void multiply_symmetric(const SparseMatrix& upper, const VectorView& x, Result<1> y, int threads) {
  check_product(upper, x.size(), threads);
  check_apart(x.data(), y.data());
  if (upper.rows() != upper.cols()) throw InvalidInput("a symmetric matrix must be square");
  // A fixed number of parts, so that the order of the sums does not depend on the threads.
  constexpr int parts = 16;
  const int n = static_cast<int>(upper.rows());
  const auto first_row = [&](int part) { return static_cast<int>(std::int64_t{n} * part / parts); };
  std::vector<Eigen::VectorXd> sums(parts);  // of rows from the part's first one on
  parallel_chunks(parts, 1, threads, [&](int part, int) {
    const int begin = first_row(part), end = first_row(part + 1);
    sums[part].setZero(reach_of_rows(upper, begin, end) - begin);
    add_symmetric_product(upper, begin, end, x.data(), sums[part].data());
  });
  double* const result = y.resized(n);
  parallel_chunks(n, 1 << 14, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) result[i] = 0;
    for (int part = 0; part < parts; ++part) {
      const int first = first_row(part);
      const int last = std::min(end, first + static_cast<int>(sums[part].size()));
      for (int i = std::max(begin, first); i < last; ++i) result[i] += sums[part][i - first];
    }
  });
}

}  // namespace gradpsi
