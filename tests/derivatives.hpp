#pragma once

#include <Eigen/Core>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <vector>

namespace gradpsi {

/// A matrix of an operator as the partial derivatives that it sums up, each by its number of times along
/// every axis.
using Partials = std::vector<Eigen::VectorXi>;

/// Those of each matrix of a derivative in d dimensions, by the definition of gradient, Laplacian, Hessian.
inline std::vector<Partials> partials(Derivative derivative, int d) {
  const auto unit = [d](int a) -> Eigen::VectorXi { return Eigen::VectorXi::Unit(d, a); };
  std::vector<Partials> matrices;
  if (derivative == Derivative::Gradient) {
    for (int a = 0; a < d; ++a) matrices.push_back({unit(a)});
  } else if (derivative == Derivative::Hessian) {
    for (int a = 0; a < d; ++a)
      for (int b = a; b < d; ++b) matrices.push_back({unit(a) + unit(b)});
  } else if (derivative == Derivative::Value) {
    matrices.push_back({Eigen::VectorXi::Zero(d)});
  } else {
    matrices.emplace_back();
    for (int a = 0; a < d; ++a) matrices[0].push_back(2 * unit(a));
  }
  return matrices;
}

/// What they make of a monomial at 0.
inline double of_monomial(const Partials& matrix, const Eigen::VectorXi& exponents) {
  double sum = 0;
  for (const Eigen::VectorXi& partial : matrix) {
    if (partial != exponents) continue;
    double product = 1;
    for (const int k : partial) product *= std::tgamma(k + 1.0);
    sum += product;
  }
  return sum;
}

/// What they make of sin(phase) where the phase is k . x and a constant.
inline double of_wave(const Partials& matrix, const Eigen::VectorXd& k, double phase) {
  double sum = 0;
  for (const Eigen::VectorXi& partial : matrix) {
    double product = std::sin(phase + partial.sum() * std::numbers::pi / 2);
    for (Eigen::Index a = 0; a < k.size(); ++a) product *= std::pow(k[a], partial[a]);
    sum += product;
  }
  return sum;
}

/// The matrices of a cloud turned by R, given those of the cloud: tensors of first and second rank, scalars.
inline std::vector<Eigen::MatrixXd> turned(Derivative derivative,
                                           const std::vector<Eigen::MatrixXd>& matrices,
                                           const Eigen::MatrixXd& R) {
  const Eigen::Index d = R.rows();
  std::vector<Eigen::MatrixXd> result;
  const auto zero = [&] { return Eigen::MatrixXd::Zero(matrices[0].rows(), matrices[0].cols()); };
  const auto entry = [d](Eigen::Index a, Eigen::Index b) {
    return a > b ? b * d - b * (b - 1) / 2 + a - b : a * d - a * (a - 1) / 2 + b - a;
  };
  if (derivative == Derivative::Laplacian || derivative == Derivative::Value) return matrices;
  for (Eigen::Index a = 0; a < d; ++a) {
    if (derivative == Derivative::Gradient) {
      result.push_back(zero());
      for (Eigen::Index b = 0; b < d; ++b) result.back() += R(a, b) * matrices[b];
      continue;
    }
    for (Eigen::Index b = a; b < d; ++b) {
      result.push_back(zero());
      for (Eigen::Index c = 0; c < d; ++c)
        for (Eigen::Index e = 0; e < d; ++e)
          result.back() += R(a, c) * R(b, e) * matrices[entry(c, e)];
    }
  }
  return result;
}

}  // namespace gradpsi
