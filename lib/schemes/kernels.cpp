#include "schemes/kernels.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/kernel.hpp"

namespace gradpsi {
namespace {

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

template <class K>
Profile profile(double q) {
  const auto p = K::profile(q);
  return {.w = p.w, .dw_over_q = p.dw_over_q, .d2w = p.d2w};
}

template <class K>
Kernel row() {
  const auto& s = K::normalisation;
  return {K::name, K::formula, profile<K>, {s[0], s[1], s[2]}};
}

template <class... K>
std::vector<Kernel> rows(KernelList<K...>) {
  return {row<K>()...};
}

}  // namespace

std::span<const Kernel> kernels() {
  static const std::vector<Kernel> table = [] {
    std::vector<Kernel> all = rows(VectorKernels());
    all.push_back(
        {"gaussian", "exp(-9q^2), cut off smoothly at q = 1", gaussian, gaussian_normalisation()});
    return all;
  }();
  return table;
}

int vector_kernel(const Kernel& kernel) {
  for (int k = 0; k < VectorKernels::count; ++k)
    if (kernels()[k].profile == kernel.profile) return k;
  return -1;
}

const Kernel& kernel(std::string_view name) {
  std::vector<std::string> valid;
  for (const Kernel& k : kernels()) {
    if (k.name == name) return k;
    valid.emplace_back(k.name);
  }
  throw_unknown("kernel", name, valid);
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
