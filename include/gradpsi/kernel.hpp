#pragma once

#include <array>
#include <span>
#include <string_view>

#pragma GCC visibility push(default)
namespace gradpsi {

/// A kernel's shape at q = r/h before normalisation: w, w'/q and w''. All are 0 at q = 1.
struct Profile {
  double w;          ///< w(q)
  double dw_over_q;  ///< w'(q) / q, finite at q = 0
  double d2w;        ///< w''(q)
};

/// One row of the kernel table. W(r) = s_d w(r/h) / h^d with support radius h: W = 0 for r >= h.
///
/// A kernel of your own is one such value: a name, its profile, and s_d. For 0 < q < 1 it must be
/// positive and fall, or the moment systems of corrected gradients are not definite; W, W' and W''
/// should vanish at r = h, or results depend on the side of h to which rounding puts a neighbour.
struct Kernel {
  std::string_view name;         ///< for messages and --kernel
  std::string_view formula;      ///< w(q), for people
  Profile (*profile)(double q);  ///< called with 0 <= q <= 1
  std::array<double, 3>
      normalisation;  ///< s_1, s_2, s_3: the integral of W over R^d is 1; 0: not for that d
};

/// All kernels; the first, the quintic Wendland kernel of the paper, is the default.
std::span<const Kernel> kernels();

/// The kernel of that name.
/// @throws InvalidInput  listing the valid names, nearest spelling first
const Kernel& kernel(std::string_view name);

/// W, W'/r and W'' at one distance.
struct KernelValue {
  double w;          ///< W(r), 1/length^d
  double dw_over_r;  ///< W'(r)/r, 1/length^(d+2)
  double d2w;        ///< W''(r), 1/length^(d+2)
};

/// The kernel's values at distance r >= 0 for support radius h > 0 in d = 1, 2 or 3 dimensions.
/// @throws InvalidInput  if a number is outside its range
KernelValue evaluate(const Kernel& kernel, int dimension, double support, double r);

}  // namespace gradpsi
#pragma GCC visibility pop
