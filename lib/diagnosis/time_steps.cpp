#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "gradpsi/spectrum.hpp"

namespace gradpsi {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

std::complex<double> growth_factor(Stepper stepper, std::complex<double> z) {
  if (stepper == Stepper::Euler) return 1.0 + z;
  return 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)));
}

double largest_stable_step(const Spectrum& spectrum, Stepper stepper) {
  const double most = stepper == Stepper::Euler ? 1 : 1 + 1e-13;
  const auto amplifies = [&](std::complex<double> z) {
    return std::norm(growth_factor(stepper, z)) > most;
  };
  double step = infinity;
  for (const std::complex<double>& lambda : spectrum.values) {
    const double size = std::abs(lambda);
    if (size <= spectrum.zero) continue;
    if (lambda.real() > spectrum.zero) return 0;
    // Along the ray of lambda the region of stability ends before |z| = 3.
    const auto direction = lambda / size;
    constexpr int steps = 300;
    double inside = 0, outside = 3;
    for (int k = 1; k <= steps; ++k) {
      const double z = 3.0 * k / steps;
      if (amplifies(z * direction)) {
        outside = z;
        break;
      }
      inside = z;
    }
    for (int halvings = 0; halvings < 50; ++halvings) {
      const double middle = (inside + outside) / 2;
      (amplifies(middle * direction) ? outside : inside) = middle;
    }
    step = std::min(step, inside / size);
  }
  return step;
}

std::vector<double> singular_steps(const Spectrum& spectrum) {
  std::vector<double> steps;
  for (const std::complex<double>& lambda : spectrum.values)
    if (lambda.real() > spectrum.zero && std::abs(lambda.imag()) <= 1e-10 * std::abs(lambda))
      steps.push_back(1 / lambda.real());
  std::ranges::sort(steps);
  const auto same = [](double a, double b) { return b - a <= 1e-9 * b; };
  steps.erase(std::unique(steps.begin(), steps.end(), same), steps.end());
  return steps;
}

}  // namespace gradpsi
