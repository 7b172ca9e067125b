#include "sell.hpp"

#include <algorithm>
#include <numeric>

#include "parallel.hpp"

namespace {

constexpr int window = 512;

int length(const gradpsi::SparseMatrix& A, int row) {
  return A.outerIndexPtr()[row + 1] - A.outerIndexPtr()[row];
}

}  // namespace

Sell::Sell(const gradpsi::SparseMatrix& A, int threads) {
  const int n = static_cast<int>(A.rows());
  const int slices = (n + lanes - 1) / lanes;
  row_.assign(static_cast<std::size_t>(slices) * lanes, -1);
  begin_.assign(slices + 1, 0);
  parallel_chunks(n, window, threads, [&](int begin, int end) {
    const auto first = row_.begin() + begin, last = row_.begin() + end;
    std::iota(first, last, begin);
    std::stable_sort(first, last, [&](int i, int j) { return length(A, i) > length(A, j); });
  });
  for (int s = 0; s < slices; ++s) begin_[s + 1] = begin_[s] + lanes * length(A, row_[s * lanes]);
  columns_.resize(begin_[slices]);
  values_.resize(begin_[slices]);
  prefer_large_pages(columns_.data(), sizeof(int) * columns_.size());
  prefer_large_pages(values_.data(), sizeof(double) * values_.size());
  parallel_chunks(slices, window, threads, [&](int begin, int end) {
    for (int s = begin; s < end; ++s) fill(A, s);
  });
}

void Sell::fill(const gradpsi::SparseMatrix& A, int slice) {
  for (int l = 0; l < lanes; ++l) {
    const int row = row_[slice * lanes + l];
    const int begin = row < 0 ? 0 : A.outerIndexPtr()[row];
    const int count = row < 0 ? 0 : length(A, row);
    int to = begin_[slice] + l;
    for (int k = 0; k < count; ++k, to += lanes) {
      columns_[to] = A.innerIndexPtr()[begin + k];
      values_[to] = A.valuePtr()[begin + k];
    }
    // Padding: nothing times an entry of x that is at hand.
    for (; to < begin_[slice + 1]; to += lanes) {
      columns_[to] = std::max(row, 0);
      values_[to] = 0;
    }
  }
}

void Sell::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y, int threads) const {
  const SellArrays arrays{begin_.data(), columns_.data(), values_.data(), row_.data()};
  const int slices = static_cast<int>(begin_.size()) - 1;
  parallel_chunks(slices, window, threads, [&](int begin, int end) {
    sell_product(arrays, begin, end, x.data(), y.data());
  });
}
