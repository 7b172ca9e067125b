#include <cmath>
#include <gradpsi/kernel.hpp>
#include <numbers>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class EveryKernel : public testing::TestWithParam<Kernel> {
 protected:
  const Kernel& kernel() const { return GetParam(); }
};

constexpr double h = 0.7;  // not 1, so that a forgotten power of h shows

/// Integral of f over [0, h] by Gauss-Legendre with five points on each of 600 intervals; a
/// multiple of six, so that the splines' knots are ends of intervals.
template <class F>
double integral(const F& f) {
  constexpr double x[] = {0, 0.5384693101056831, 0.9061798459386640};
  constexpr double w[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  constexpr int intervals = 600;
  double sum = 0;
  for (int k = 0; k < intervals; ++k) {
    const double half = h / intervals / 2;
    const double middle = (2 * k + 1) * half;
    sum += half * w[0] * f(middle);
    for (int p = 1; p < 3; ++p)
      sum += half * w[p] * (f(middle - half * x[p]) + f(middle + half * x[p]));
  }
  return sum;
}

TEST_P(EveryKernel, IntegratesToOneInEachDimension) {
  const double pi = std::numbers::pi;
  const auto w = [&](int d, double r) { return evaluate(kernel(), d, h, r).w; };
  EXPECT_NEAR(integral([&](double r) { return 2 * w(1, r); }), 1, 1e-10);
  EXPECT_NEAR(integral([&](double r) { return 2 * pi * r * w(2, r); }), 1, 1e-10);
  EXPECT_NEAR(integral([&](double r) { return 4 * pi * r * r * w(3, r); }), 1, 1e-10);
}

TEST_P(EveryKernel, DerivativesAgreeWithFiniteDifferences) {
  const double step = 1e-4 * h;
  for (int d = 1; d <= 3; ++d)
    for (double r = 0.03 * h; r < 0.99 * h; r += 0.01713 * h) {
      const auto before = evaluate(kernel(), d, h, r - step);
      const auto here = evaluate(kernel(), d, h, r);
      const auto after = evaluate(kernel(), d, h, r + step);
      // Central differences err by step^2 times the next derivatives, at most a few thousand s_d.
      const double scale = kernel().normalisation[d - 1] / std::pow(h, d + 2);
      EXPECT_NEAR(here.dw_over_r, (after.w - before.w) / (2 * step) / r, 1e-5 * scale)
          << d << " " << r;
      const double slope_before = before.dw_over_r * (r - step);
      const double slope_after = after.dw_over_r * (r + step);
      // A spline's third derivative jumps at its knots: there the difference errs by step.
      EXPECT_NEAR(here.d2w, (slope_after - slope_before) / (2 * step), 5e-3 * scale)
          << d << " " << r;
    }
}

TEST_P(EveryKernel, IsSmoothAtZero) {
  const auto at_zero = evaluate(kernel(), 2, h, 0);
  const auto near_zero = evaluate(kernel(), 2, h, 1e-9 * h);
  EXPECT_NEAR(near_zero.dw_over_r, at_zero.dw_over_r, 1e-6 * std::abs(at_zero.dw_over_r));
  EXPECT_NEAR(at_zero.d2w, at_zero.dw_over_r, 1e-12 * std::abs(at_zero.d2w));  // W'' = lim W'/r
}

// A neighbour at distance h may be found or not, as rounding has it: it must not matter.
TEST_P(EveryKernel, VanishesWithTwoDerivativesAtTheSupport) {
  const Profile p = kernel().profile(1);
  EXPECT_NEAR(p.w, 0, 1e-15);
  EXPECT_NEAR(p.dw_over_q, 0, 1e-15);
  EXPECT_NEAR(p.d2w, 0, 1e-15);
  EXPECT_EQ(evaluate(kernel(), 2, h, h).w, 0);
}

TEST_P(EveryKernel, IsPositiveAndFalls) {
  for (double r = 0; r < 0.999 * h; r += 0.01 * h) {
    EXPECT_GT(evaluate(kernel(), 3, h, r).w, 0);
    EXPECT_LT(evaluate(kernel(), 3, h, r).dw_over_r, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, EveryKernel,
                         testing::ValuesIn(kernels().begin(), kernels().end()),
                         [](const auto& p) { return identifier(std::string(p.param.name)); });

TEST(Kernel, TheDefaultIsThePapersQuinticWendland) {
  const Kernel& wendland = kernels().front();
  EXPECT_EQ(wendland.name, "wendland-c2");
  const double q = 0.3;
  EXPECT_NEAR(evaluate(wendland, 2, 1, q).w,
              7 / std::numbers::pi * std::pow(1 - q, 4) * (1 + 4 * q), 1e-15);
}

TEST(Kernel, TheGaussianIsWithinSevenThousandthsOfAPlainOne) {
  for (double q = 0; q <= 1; q += 0.01)
    EXPECT_NEAR(kernel("gaussian").profile(q).w, std::exp(-9 * q * q), 0.007);
}

TEST(Fault15, AnUnknownKernelIsAnsweredWithTheNearestFirst) {
  EXPECT_EQ(kernel("wendland-c4").name, "wendland-c4");
  const auto message = message_of<InvalidInput>([] { kernel("wendland-c5"); });
  EXPECT_THAT(message, StartsWith("unknown kernel 'wendland-c5'; valid: wendland-c"));
  EXPECT_THAT(message, HasSubstr("gaussian"));
}

TEST(Kernel, ArgumentsAreChecked) {
  EXPECT_THROW(evaluate(kernels()[0], 4, 1, 0.5), InvalidInput);
  EXPECT_THROW(evaluate(kernels()[0], 2, 0, 0.5), InvalidInput);
  EXPECT_THROW(evaluate(kernels()[0], 2, NAN, 0.5), InvalidInput);
  EXPECT_THROW(evaluate(kernels()[0], 2, 1, -0.5), InvalidInput);
}

}  // namespace
}  // namespace gradpsi
