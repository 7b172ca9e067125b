#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "clouds.hpp"

namespace gradpsi {

/// Whether only the n-th allocation fails or all from the n-th on, and with how many threads.
struct Failure {
  bool all;
  int threads;
  int lost = 0;  // allocations that Eigen may lose: see Solvers
};

/// Calls `call` with ever later failures. After each, `unchanged` tells whether all is as before the call, and
/// `call` returns whether its result is right.
void fail_each(
    const Failure& failure, const std::function<bool()>& call,
    const std::function<bool()>& unchanged = [] { return true; });

class Fault20 : public testing::TestWithParam<Failure> {
 protected:
  static void SetUpTestSuite();
  int threads() const { return GetParam().threads; }
};

inline bool equal(const Cloud& a, const Cloud& b) {
  return a.positions() == b.positions() && a.volumes() == b.volumes() && a.box() == b.box();
}
inline bool equal(const Neighbours& a, const Neighbours& b) {
  return a.offsets == b.offsets && a.indices == b.indices && a.supports == b.supports;
}
inline bool equal(const SparseMatrix& a, const SparseMatrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
         std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.rows() + 1, b.outerIndexPtr()) &&
         std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr()) &&
         std::equal(a.valuePtr(), a.valuePtr() + a.nonZeros(), b.valuePtr());
}
inline bool equal(const std::vector<Operator>& a, const std::vector<Operator>& b) {
  return std::ranges::equal(a, b, [](const Operator& p, const Operator& q) {
    return p.volumes == q.volumes && p.rows.outcome == q.rows.outcome &&
           std::ranges::equal(p.axes, q.axes,
                              [](const auto& A, const auto& B) { return equal(A, B); });
  });
}

}  // namespace gradpsi
