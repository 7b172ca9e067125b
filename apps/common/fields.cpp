#include "common/fields.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace gradpsi::apps {

namespace {

constexpr double pi = std::numbers::pi;

/// Largest |cos| between two phases.
double largest_cosine(double from, double to) {
  const bool peak = std::floor(from / pi) != std::floor(to / pi);
  return peak ? 1 : std::max(std::abs(std::cos(from)), std::abs(std::cos(to)));
}

/// Largest size of a factor's derivatives of even and odd order within `support` of x, over wave_number^order.
std::array<double, 2> largest_even_and_odd(const TestField::Factor& factor, double x,
                                           double support) {
  const double reach = factor.wave_number * support;
  const double cosine_phase =
      factor.wave_number * x + factor.phase - (factor.wave == TestField::Wave::Sine ? pi / 2 : 0);
  const auto largest = [&](double phase) { return largest_cosine(phase - reach, phase + reach); };
  return {largest(cosine_phase), largest(cosine_phase + pi / 2)};
}

/// How many of the partial derivatives of order k + l + m are the same one, k times along the first axis.
double multiplicity(int k, int l, int m) {
  return std::tgamma(k + l + m + 1) /
         (std::tgamma(k + 1) * std::tgamma(l + 1) * std::tgamma(m + 1));
}

}  // namespace

Exact exact(const TestField& field, const Positions& x) {
  const Eigen::Index d = x.cols();
  Eigen::ArrayXXd values(x.rows(), d), slopes(x.rows(), d);
  double squared = 0;  // the wave vector's length, squared
  for (Eigen::Index a = 0; a < d; ++a) {
    const auto& [wave, k, shift] = field.factors[a];
    const Eigen::ArrayXd phase = k * x.col(a).array() + shift;
    const bool sine = wave == TestField::Wave::Sine;
    values.col(a) = sine ? phase.sin().eval() : phase.cos().eval();
    slopes.col(a) = sine ? (k * phase.cos()).eval() : (-k * phase.sin()).eval();
    squared += k * k;
  }
  const Eigen::ArrayXd product = values.rowwise().prod();
  Exact result{field.offset + product, Eigen::MatrixXd(x.rows(), d), -squared * product,
               Eigen::MatrixXd(x.rows(), d * (d + 1) / 2)};
  for (Eigen::Index a = 0, component = 0; a < d; ++a) {
    Eigen::ArrayXXd once = values;
    once.col(a) = slopes.col(a);
    result.gradient.col(a) = once.rowwise().prod();
    const double k = field.factors[a].wave_number;
    result.hessian.col(component++) = -k * k * product;
    for (Eigen::Index b = a + 1; b < d; ++b) {
      Eigen::ArrayXXd twice = once;
      twice.col(b) = slopes.col(b);
      result.hessian.col(component++) = twice.rowwise().prod();
    }
  }
  return result;
}

Eigen::VectorXd errors(Derivative derivative, const Operator& op, const Exact& exact) {
  // In the order of Derivative.
  const std::array<Eigen::MatrixXd, 4> all = {exact.gradient, exact.laplacian, exact.hessian,
                                              exact.u};
  const Eigen::MatrixXd& should_be = all.at(static_cast<std::size_t>(derivative));
  const auto names = components(derivative, static_cast<int>(exact.gradient.cols()));
  Eigen::VectorXd squared = Eigen::VectorXd::Zero(exact.u.size());
  for (std::size_t a = 0; a < op.axes.size(); ++a) {
    const bool twice = derivative == Derivative::Hessian && names[a].front() != names[a].back();
    squared += (twice ? 2 : 1) *
               (op.axes[a] * exact.u - should_be.col(static_cast<Eigen::Index>(a))).cwiseAbs2();
  }
  return squared.cwiseSqrt();
}

Eigen::MatrixXd derivative_bounds(const TestField& field, const Positions& x,
                                  const Eigen::VectorXd& supports, int most) {
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(supports.size(), most + 1);
  for (Eigen::Index i = 0; i < supports.size(); ++i) {
    // An axis that is not there has a factor 1 and no derivatives.
    std::array<std::array<double, 2>, 3> largest = {{{1, 0}, {1, 0}, {1, 0}}};
    std::array<double, 3> wave_numbers = {0, 0, 0};
    for (Eigen::Index a = 0; a < x.cols(); ++a) {
      largest[a] = largest_even_and_odd(field.factors[a], x(i, a), supports[i]);
      wave_numbers[a] = field.factors[a].wave_number;
    }
    for (int k = 0; k <= most; ++k)
      for (int l = 0; k + l <= most; ++l)
        for (int m = 0; k + l + m <= most; ++m) {
          double product = 1;
          for (const auto& [a, order] : {std::pair(0, k), std::pair(1, l), std::pair(2, m)})
            product *= std::pow(wave_numbers[a], order) * largest[a][order % 2];
          squares(i, k + l + m) += multiplicity(k, l, m) * product * product;
        }
  }
  return squares.cwiseSqrt();
}

}  // namespace gradpsi::apps
