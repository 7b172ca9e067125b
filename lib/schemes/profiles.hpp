#pragma once

#include "base/lanes.hpp"
#include "gradpsi/kernel.hpp"

namespace gradpsi {

// The kernels' profiles w, w'/q, w'' at 0 <= q <= 1, for a double or for several at once. Those of other
// kernels, which only their function knows, are called lane by lane.

template <class T>
struct ProfileOf {
  T w, dw_over_q, d2w;
};

template <class T>
[[gnu::always_inline]] inline constexpr T power(T x, int n) {
  T result = x;
  for (int k = 1; k < n; ++k) result *= x;
  return result;
}

template <class T>
[[gnu::always_inline]] inline ProfileOf<T> wendland_c2(T q) {
  const T t = 1 - q;
  return {power(t, 4) * (1 + 4 * q), -20 * power(t, 3), 20 * power(t, 2) * (4 * q - 1)};
}

template <class T>
[[gnu::always_inline]] inline ProfileOf<T> wendland_c4(T q) {
  const T t = 1 - q;
  return {power(t, 6) * (1 + q * (6 + q * (35.0 / 3))), (-56.0 / 3) * power(t, 5) * (1 + 5 * q),
          (-56.0 / 3) * power(t, 4) * (1 + q * (4 - 35 * q))};
}

template <class T>
[[gnu::always_inline]] inline ProfileOf<T> wendland_c6(T q) {
  const T t = 1 - q;
  return {power(t, 8) * (1 + q * (8 + q * (25 + 32 * q))),
          -22 * power(t, 7) * (1 + q * (7 + 16 * q)),
          -22 * power(t, 6) * (1 + q * (6 - q * (15 + 160 * q)))};
}

// The splines are sums of truncated powers; the innermost piece is expanded, because there the
// powers cancel and w'/q would lose digits as q -> 0.
template <class T>
[[gnu::always_inline]] inline ProfileOf<T> cubic_spline(T q) {
  const T t = 1 - q;
  return {q < 0.5 ? 0.5 + q * q * 3 * (q - 1) : power(t, 3),
          q < 0.5 ? 9 * q - 6 : -3 * power(t, 2) / q, q < 0.5 ? 18 * q - 6 : 6 * t};
}

template <class T>
[[gnu::always_inline]] inline ProfileOf<T> quintic_spline(T q) {
  const T s = q * q, t = 1 - q;
  const T t2 = q < 2.0 / 3 ? 2.0 / 3 - q : T{};
  return {
      q < 1.0 / 3 ? 22.0 / 81 + s * (-20.0 / 9 + s * 10 * (1 - q)) : power(t, 5) - 6 * power(t2, 5),
      q < 1.0 / 3 ? -40.0 / 9 + s * (40 - 50 * q) : (-5 * power(t, 4) + 30 * power(t2, 4)) / q,
      q < 1.0 / 3 ? -40.0 / 9 + s * (120 - 200 * q) : 20 * power(t, 3) - 120 * power(t2, 3)};
}

/// Which of the profiles above a kernel's function is.
enum class Shape { WendlandC2, WendlandC4, WendlandC6, CubicSpline, QuinticSpline, Other };
Shape shape(const Kernel& kernel);

}  // namespace gradpsi
