#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/kernel.hpp"
#include "schemes/profiles.hpp"

namespace gradpsi {
namespace {

constexpr double pi = std::numbers::pi;

/// One of profiles.hpp for a single q.
template <ProfileOf<double> (*shape)(double)>
Profile profile(double q) {
  const auto p = shape(q);
  return {.w = p.w, .dw_over_q = p.dw_over_q, .d2w = p.d2w};
}

// exp(-9 s), s = q^2, minus its Taylor polynomial of degree 2 about s = 1. A Gaussian merely cut
// off jumps at r = h, and a neighbour there would count or not as rounding has it; this one meets
// zero with two continuous derivatives and differs from the plain one by at most 0.7 %.
constexpr double exp_9 = 1.2340980408667956e-4;  // exp(-9)

Profile gaussian(double q) {
  const double s = q * q;
  const double t = 1 - s;
  const double f = std::exp(-9 * s) - exp_9 * (1 + 9 * t + 40.5 * t * t);
  const double df = -9 * std::exp(-9 * s) + exp_9 * (9 + 81 * t);  // with respect to s
  const double d2f = 81 * (std::exp(-9 * s) - exp_9);
  return {.w = f, .dw_over_q = 2 * df, .d2w = 2 * df + 4 * s * d2f};
}

// One over the integral of gaussian() over the unit ball of each dimension.
std::array<double, 3> gaussian_normalisation() {
  const double e = std::sqrt(pi) * std::erf(3.0);
  return {1 / (e / 3 - 57.2 * exp_9), 1 / (pi * ((1 - exp_9) / 9 - 19 * exp_9)),
          1 / (4 * pi * (e / 108 - exp_9 * (1.0 / 18 + 97.0 / 21)))};
}

}  // namespace

// H. Wendland, Adv. Comput. Math. 4 (1995); the paper uses the three-dimensional C2 polynomial in
// one dimension too, and so does this table for C4 and C6. Splines: I. J. Schoenberg (1946).
std::span<const Kernel> kernels() {
  static const std::array<Kernel, 6> table = {{
      {"wendland-c2", "(1-q)^4 (1+4q)", profile<wendland_c2>, {3.0 / 2, 7 / pi, 21 / (2 * pi)}},
      {"wendland-c4",
       "(1-q)^6 (1+6q+35q^2/3)",
       profile<wendland_c4>,
       {27.0 / 16, 9 / pi, 495 / (32 * pi)}},
      {"wendland-c6",
       "(1-q)^8 (1+8q+25q^2+32q^3)",
       profile<wendland_c6>,
       {15.0 / 8, 78 / (7 * pi), 1365 / (64 * pi)}},
      {"cubic-spline",
       "(1-q)^3 - 4 (1/2-q)_+^3",
       profile<cubic_spline>,
       {8.0 / 3, 80 / (7 * pi), 16 / pi}},
      {"quintic-spline",
       "(1-q)^5 - 6 (2/3-q)_+^5 + 15 (1/3-q)_+^5",
       profile<quintic_spline>,
       {243.0 / 40, 15309 / (478 * pi), 2187 / (40 * pi)}},
      {"gaussian", "exp(-9q^2), cut off smoothly at q = 1", gaussian, gaussian_normalisation()},
  }};
  return table;
}

const Kernel& kernel(std::string_view name) {
  std::vector<std::string> valid;
  for (const Kernel& k : kernels()) {
    if (k.name == name) return k;
    valid.emplace_back(k.name);
  }
  throw_unknown("kernel", name, valid);
}

Shape shape(const Kernel& kernel) {
  const auto is = [&](Profile (*function)(double)) { return kernel.profile == function; };
  return is(profile<wendland_c2>)      ? Shape::WendlandC2
         : is(profile<wendland_c4>)    ? Shape::WendlandC4
         : is(profile<wendland_c6>)    ? Shape::WendlandC6
         : is(profile<cubic_spline>)   ? Shape::CubicSpline
         : is(profile<quintic_spline>) ? Shape::QuinticSpline
                                       : Shape::Other;
}

KernelValue evaluate(const Kernel& kernel, int dimension, double support, double r) {
  if (dimension < 1 || dimension > 3)
    throw InvalidInput("dimension must be 1, 2 or 3, not " + std::to_string(dimension));
  if (!(support > 0)) throw InvalidInput("support must be > 0, not " + shortest(support));
  if (!(r >= 0)) throw InvalidInput("distance must be >= 0, not " + shortest(r));
  if (r >= support) return {};
  const Profile p = kernel.profile(r / support);
  const double scale = kernel.normalisation[dimension - 1] / std::pow(support, dimension);
  const double square = support * support;
  return {
      .w = scale * p.w, .dw_over_r = scale / square * p.dw_over_q, .d2w = scale / square * p.d2w};
}

}  // namespace gradpsi
