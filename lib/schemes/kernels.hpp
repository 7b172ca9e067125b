#pragma once

#include <numbers>

#include "base/lanes.hpp"

namespace gradpsi {

// The kernels: a struct each, with what a row of kernels() says and the profile w, w'/q, w'' at
// 0 <= q <= 1, for a double or for several at once. H. Wendland, Adv. Comput. Math. 4 (1995); the paper
// uses the three-dimensional C2 polynomial in one dimension too, and so do C4 and C6 here. Splines:
// I. J. Schoenberg (1946).

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

inline constexpr double pi = std::numbers::pi;

struct WendlandC2 {
  static constexpr const char* name = "wendland-c2";
  static constexpr const char* formula = "(1-q)^4 (1+4q)";
  static constexpr double normalisation[3] = {3.0 / 2, 7 / pi, 21 / (2 * pi)};
  template <class T>
  [[gnu::always_inline]] static ProfileOf<T> profile(T q) {
    const T t = 1 - q;
    return {power(t, 4) * (1 + 4 * q), -20 * power(t, 3), 20 * power(t, 2) * (4 * q - 1)};
  }
};

struct WendlandC4 {
  static constexpr const char* name = "wendland-c4";
  static constexpr const char* formula = "(1-q)^6 (1+6q+35q^2/3)";
  static constexpr double normalisation[3] = {27.0 / 16, 9 / pi, 495 / (32 * pi)};
  template <class T>
  [[gnu::always_inline]] static ProfileOf<T> profile(T q) {
    const T t = 1 - q;
    return {power(t, 6) * (1 + q * (6 + q * (35.0 / 3))), (-56.0 / 3) * power(t, 5) * (1 + 5 * q),
            (-56.0 / 3) * power(t, 4) * (1 + q * (4 - 35 * q))};
  }
};

struct WendlandC6 {
  static constexpr const char* name = "wendland-c6";
  static constexpr const char* formula = "(1-q)^8 (1+8q+25q^2+32q^3)";
  static constexpr double normalisation[3] = {15.0 / 8, 78 / (7 * pi), 1365 / (64 * pi)};
  template <class T>
  [[gnu::always_inline]] static ProfileOf<T> profile(T q) {
    const T t = 1 - q;
    return {power(t, 8) * (1 + q * (8 + q * (25 + 32 * q))),
            -22 * power(t, 7) * (1 + q * (7 + 16 * q)),
            -22 * power(t, 6) * (1 + q * (6 - q * (15 + 160 * q)))};
  }
};

// The splines are sums of truncated powers; the innermost piece is expanded, because there the
// powers cancel and w'/q would lose digits as q -> 0.
struct CubicSpline {
  static constexpr const char* name = "cubic-spline";
  static constexpr const char* formula = "(1-q)^3 - 4 (1/2-q)_+^3";
  static constexpr double normalisation[3] = {8.0 / 3, 80 / (7 * pi), 16 / pi};
  template <class T>
  [[gnu::always_inline]] static ProfileOf<T> profile(T q) {
    const T t = 1 - q;
    return {q < 0.5 ? 0.5 + q * q * 3 * (q - 1) : power(t, 3),
            q < 0.5 ? 9 * q - 6 : -3 * power(t, 2) / q, q < 0.5 ? 18 * q - 6 : 6 * t};
  }
};

struct QuinticSpline {
  static constexpr const char* name = "quintic-spline";
  static constexpr const char* formula = "(1-q)^5 - 6 (2/3-q)_+^5 + 15 (1/3-q)_+^5";
  static constexpr double normalisation[3] = {243.0 / 40, 15309 / (478 * pi), 2187 / (40 * pi)};
  template <class T>
  [[gnu::always_inline]] static ProfileOf<T> profile(T q) {
    const T s = q * q, t = 1 - q;
    const T t2 = q < 2.0 / 3 ? 2.0 / 3 - q : T{};
    return {
        q < 1.0 / 3 ? 22.0 / 81 + s * (-20.0 / 9 + s * 10 * (1 - q))
                    : power(t, 5) - 6 * power(t2, 5),
        q < 1.0 / 3 ? -40.0 / 9 + s * (40 - 50 * q) : (-5 * power(t, 4) + 30 * power(t2, 4)) / q,
        q < 1.0 / 3 ? -40.0 / 9 + s * (120 - 200 * q) : 20 * power(t, 3) - 120 * power(t2, 3)};
  }
};

/// The kernels that the vector code has, the commonest first. Others, of which only the function is known,
/// are called lane by lane.
template <class... Kernels>
struct KernelList {
  static constexpr int count = sizeof...(Kernels);
};
using VectorKernels = KernelList<WendlandC2, WendlandC4, WendlandC6, CubicSpline, QuinticSpline>;

}  // namespace gradpsi
