#include "solve/krylov.hpp"

#include <array>
#include <cmath>

#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

constexpr int block = 4096;

}  // namespace

Krylov::Krylov(int n, int threads)
    : n_(n), threads_(checked_threads(threads)), partial_(3 * (n / block + 1)) {
  for (Eigen::VectorXd* vector : {&r_, &start_, &p_, &v_, &s_, &t_, &y_, &z_}) vector->setZero(n);
}

template <class F>
void Krylov::each(const F& f) {
  parallel_chunks(n_, block, threads_, [&f](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i);
  });
}

/// Adds up f(i), an array of as many numbers, over all i.
template <int Sums, class F>
std::array<double, Sums> Krylov::sum(const F& f) {
  double* const partial = partial_.data();
  parallel_chunks(n_, block, threads_, [partial, &f](int begin, int end) {
    std::array<double, Sums> sums = {};
    for (int i = begin; i < end; ++i) {
      const std::array<double, Sums> terms = f(i);
      for (int k = 0; k < Sums; ++k) sums[k] += terms[k];
    }
    for (int k = 0; k < Sums; ++k) partial[begin / block * Sums + k] = sums[k];
  });
  std::array<double, Sums> total = {};
  for (int c = 0; c < n_ / block + (n_ % block > 0); ++c)
    for (int k = 0; k < Sums; ++k) total[k] += partial[c * Sums + k];
  return total;
}

double Krylov::weighted_sum(const double* weights, const double* x) {
  return sum<1>([=](int i) { return std::array{weights[i] * x[i]}; })[0];
}

void Krylov::multiply(const Matrix& matrix, const double* x, double* y) {
  for_each_product(matrix.A, x, threads_, [y](int i, double product) { y[i] = product; });
  if (!matrix.weights) return;
  const double more = matrix.strength * weighted_sum(matrix.weights, x);
  each([=](int i) { y[i] += more; });
}

/// z = M^-1 r; of the mean, which the preconditioner of a singular A is not for, what the matrix makes of it.
void Krylov::apply(const Matrix& matrix, const Precondition& precondition, const double* r,
                   double* z) {
  if (!matrix.weights) return precondition(r, z);
  const double total = sum<1>([w = matrix.weights](int i) { return std::array{w[i]}; })[0];
  const double mean = weighted_sum(matrix.weights, r) / total;
  without_mean_.resize(n_);
  double* const rest = without_mean_.data();
  each([=](int i) { rest[i] = r[i] - mean; });
  precondition(rest, z);
  const double shift = (mean / matrix.strength - weighted_sum(matrix.weights, z)) / total;
  each([=](int i) { z[i] += shift; });
}

/// z = M^-1 r, y = A z
void Krylov::multiply(const Matrix& matrix, const Precondition& precondition, const double* r,
                      double* z, double* y) {
  apply(matrix, precondition, r, z);
  multiply(matrix, z, y);
}

/// r_ = b - A x; its 2-norm.
double Krylov::residual(const Matrix& matrix, const double* b, const double* x) {
  double* const r = r_.data();
  multiply(matrix, x, r);
  return std::sqrt(sum<1>([=](int i) {
    r[i] = b[i] - r[i];
    return std::array{r[i] * r[i]};
  })[0]);
}

/// From the residual as it is now.
void Krylov::start_anew() {
  start_ = r_;
  p_.setZero();
  v_.setZero();
}

int Krylov::conjugate_gradients(const Matrix& matrix, const VectorView& scale,
                                const Precondition& precondition, const double* b, double* x,
                                const Goal& goal) {
  double* const r = r_.data();
  double* const p = p_.data();
  double* const v = v_.data();
  double* const z = z_.data();
  const double* const d = scale.data();
  if (residual(matrix, b, x) <= goal.target) return 0;
  double before = 0;
  for (int iteration = 1; iteration <= goal.limit; ++iteration) {
    apply(matrix, precondition, r, z);
    const auto [rz] = sum<1>([=](int i) { return std::array{d[i] * r[i] * z[i]}; });
    const double beta = iteration == 1 ? 0 : rz / before;
    before = rz;
    each([=](int i) { p[i] = z[i] + beta * p[i]; });
    multiply(matrix, p, v);
    const auto [pv] = sum<1>([=](int i) { return std::array{d[i] * p[i] * v[i]}; });
    const double alpha = rz / pv;
    if (!std::isfinite(alpha)) return iteration;
    const auto [squared] = sum<1>([=](int i) {
      x[i] += alpha * p[i];
      r[i] -= alpha * v[i];
      return std::array{r[i] * r[i]};
    });
    if (goal.is_reached(iteration, std::sqrt(squared))) return iteration;
  }
  return goal.limit;
}

int Krylov::bicgstab(const Matrix& matrix, const Precondition& precondition, const double* b,
                     double* x, const Goal& goal) {
  double *const r = r_.data(), *const start = start_.data(), *const p = p_.data();
  double *const v = v_.data(), *const s = s_.data(), *const t = t_.data();
  double *const y = y_.data(), *const z = z_.data();
  double norm = residual(matrix, b, x);
  if (norm <= goal.target) return 0;
  double rho = 0, alpha = 0, omega = 0, start_norm = 0;
  for (int iteration = 1; iteration <= goal.limit; ++iteration) {
    auto [next] = sum<1>([=](int i) { return std::array{start[i] * r[i]}; });
    // Where the residual has become orthogonal to the one it started from, start again.
    if (rho == 0 || !(std::abs(next) > 1e-14 * start_norm * norm)) {
      start_anew();
      start_norm = norm;
      next = norm * norm;
      rho = alpha = omega = 1;
    }
    const double beta = next / rho * (alpha / omega);
    rho = next;
    each([=](int i) { p[i] = r[i] + beta * (p[i] - omega * v[i]); });
    multiply(matrix, precondition, p, y, v);
    const auto [start_v] = sum<1>([=](int i) { return std::array{start[i] * v[i]}; });
    alpha = rho / start_v;
    if (!std::isfinite(alpha)) return iteration;
    each([=](int i) { s[i] = r[i] - alpha * v[i]; });
    multiply(matrix, precondition, s, z, t);
    const auto [ts, tt] = sum<2>([=](int i) { return std::array{t[i] * s[i], t[i] * t[i]}; });
    omega = tt > 0 ? ts / tt : 0;
    const auto [squared] = sum<1>([=](int i) {
      x[i] += alpha * y[i] + omega * z[i];
      r[i] = s[i] - omega * t[i];
      return std::array{r[i] * r[i]};
    });
    norm = std::sqrt(squared);
    if (goal.is_reached(iteration, norm)) return iteration;
    if (omega == 0) rho = 0;
  }
  return goal.limit;
}

}  // namespace gradpsi
