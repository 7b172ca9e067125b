#include <cmath>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "calculus/blocks.hpp"
#include "calculus/contractions.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spmv.hpp"
#include "gradpsi/vector_calculus.hpp"
#include "matrix/pass.hpp"

namespace gradpsi {
namespace {

void check(const Operator& hessian, const Operator& gradient, const VectorView& mu, int threads) {
  const auto d = std::ssize(gradient.axes);
  if (d < 1 || d > 3 || std::ssize(hessian.axes) != d * (d + 1) / 2)
    throw InvalidInput(
        "viscous forces take d matrices of a gradient and d(d+1)/2 of a Hessian, not " +
        std::to_string(d) + " and " + std::to_string(hessian.axes.size()));
  for (const Operator* op : {&gradient, &hessian}) {
    for (const SparseMatrix& A : op->axes) check_product(A, A.cols(), threads);
    check_share_pattern(op->axes);
  }
  if (hessian.points != gradient.points || !same_pattern(hessian.matrix(), gradient.matrix()))
    throw InvalidInput("the Hessian and the gradient do not share their rows and pattern");
  if (gradient.points.empty() && gradient.matrix().rows() != gradient.matrix().cols())
    throw InvalidInput("a viscous force takes operators of rows of the points, not of probes");
  if (mu.size() != gradient.matrix().cols())
    throw InvalidInput("there are " + std::to_string(mu.size()) + " viscosities for " +
                       std::to_string(gradient.matrix().cols()) + " points");
  for (Eigen::Index i = 0; i < mu.size(); ++i)
    if (!(mu[i] >= 0 && std::isfinite(mu[i])))
      throw InvalidInput("the viscosity at point " + std::to_string(i) +
                         " must be >= 0 and finite, not " + shortest(mu[i]));
}

}  // namespace

SparseMatrix viscous_force(const Operator& hessian, const Operator& gradient, const VectorView& mu,
                           int threads) {
  check(hessian, gradient, mu, threads);
  const auto d = static_cast<int>(gradient.axes.size());
  const SparseMatrix& pattern = gradient.matrix();
  DenseMatrix slope;  // of mu
  multiply(gradient.axes, mu, slope, threads);
  const auto second = [&](int a, int b) {
    return hessian.axes[symmetric_pair(a, b, d)].valuePtr();
  };
  // Block (a, b) has H_ab, on the diagonal with the Laplacian, each entry times the mean of the two mu, and
  // what is left of d_b(mu d_a v_b).
  const auto fill = [&](int a, int b, int i, double* values) {
    const int begin = pattern.outerIndexPtr()[i], end = pattern.outerIndexPtr()[i + 1];
    const int own = gradient.point(i);
    double sum = 0, *diagonal = nullptr;
    for (int k = begin; k < end; ++k, ++values) {
      const int j = pattern.innerIndexPtr()[k];
      if (j == own) {
        diagonal = values;
        continue;
      }
      double h = second(a, b)[k];
      for (int c = 0; a == b && c < d; ++c) h += second(c, c)[k];
      *values = h * (mu[own] + mu[j]) / 2 + (slope(i, b) * gradient.axes[a].valuePtr()[k] -
                                             slope(i, a) * gradient.axes[b].valuePtr()[k]) /
                                                2;
      sum += *values;
    }
    if (diagonal) *diagonal = 0 - sum;
  };
  return of_blocks(
      pattern, d, d, [](int, int) { return true; }, fill, threads);
}

}  // namespace gradpsi
