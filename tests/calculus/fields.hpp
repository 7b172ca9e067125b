#pragma once

#include <Eigen/Dense>
#include <gradpsi/gradpsi.hpp>
#include <random>
#include <vector>

namespace gradpsi {

/// A polynomial with exact derivatives: the sum over some directions q of c (q . x + s)^p.
class Polynomial {
 public:
  Polynomial(int dimension, int degree, std::uint64_t seed) : degree_(degree) {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> number(-1, 1);
    for (int k = 0; k < 5; ++k)
      terms_.push_back({Eigen::VectorXd::NullaryExpr(dimension, [&] { return number(generator); }),
                        number(generator), 1 + number(generator)});
  }

  Eigen::VectorXd operator()(const Positions& x) const { return derivative(x, {}); }
  /// By these axes, none, one or two of them.
  Eigen::VectorXd derivative(const Positions& x, const std::vector<int>& axes) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(x.rows());
    const int power = degree_ - static_cast<int>(axes.size());
    for (const auto& [q, c, shift] : terms_) {
      if (power < 0) continue;
      double factor = c;
      for (std::size_t k = 0; k < axes.size(); ++k)
        factor *= (degree_ - static_cast<double>(k)) * q[axes[k]];
      sum += factor * ((x * q).array() + shift).pow(power).matrix();
    }
    return sum;
  }

 private:
  struct Ridge {
    Eigen::VectorXd q;
    double c, shift;
  };
  int degree_;
  std::vector<Ridge> terms_;
};

/// A vector of them, a component each.
struct PolynomialVector {
  std::vector<Polynomial> components;

  PolynomialVector(int dimension, int degree, std::uint64_t seed = 7) {
    for (int a = 0; a < dimension; ++a) components.emplace_back(dimension, degree, seed + a);
  }

  int dimension() const { return static_cast<int>(components.size()); }
  Eigen::MatrixXd operator()(const Positions& x) const {
    Eigen::MatrixXd v(x.rows(), dimension());
    for (int a = 0; a < dimension(); ++a) v.col(a) = components[a](x);
    return v;
  }
  /// d v_a / dx_b
  Eigen::VectorXd d(const Positions& x, int a, int b) const {
    return components[a].derivative(x, {b});
  }
  /// d^2 v_a / dx_b dx_c
  Eigen::VectorXd dd(const Positions& x, int a, int b, int c) const {
    return components[a].derivative(x, {b, c});
  }
};

/// The operators by their definitions.
inline Eigen::MatrixXd exact(VectorOperator what, const PolynomialVector& v, const Positions& x) {
  const int d = v.dimension();
  std::vector<Eigen::VectorXd> columns;
  if (what == VectorOperator::Gradient) {
    for (int a = 0; a < d; ++a) columns.push_back(v.d(x, 0, a));
  } else if (what == VectorOperator::Divergence) {
    columns.emplace_back(Eigen::VectorXd::Zero(x.rows()));
    for (int a = 0; a < d; ++a) columns[0] += v.d(x, a, a);
  } else if (what == VectorOperator::Curl && d == 2) {
    columns = {v.d(x, 1, 0) - v.d(x, 0, 1)};
  } else if (what == VectorOperator::Curl) {
    columns = {v.d(x, 2, 1) - v.d(x, 1, 2), v.d(x, 0, 2) - v.d(x, 2, 0),
               v.d(x, 1, 0) - v.d(x, 0, 1)};
  } else if (what == VectorOperator::GradDiv) {
    for (int a = 0; a < d; ++a) {
      columns.emplace_back(Eigen::VectorXd::Zero(x.rows()));
      for (int b = 0; b < d; ++b) columns[a] += v.dd(x, b, a, b);
    }
  } else {
    const bool strain = what == VectorOperator::Strain;
    for (int a = 0; a < d; ++a)
      for (int b = strain ? a : 0; b < d; ++b)
        columns.push_back(strain ? ((v.d(x, a, b) + v.d(x, b, a)) / 2).eval() : v.d(x, a, b));
  }
  Eigen::MatrixXd result(x.rows(), columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c)
    result.col(static_cast<Eigen::Index>(c)) = columns[c];
  return result;
}

}  // namespace gradpsi
