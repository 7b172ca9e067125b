#pragma once

#include <Eigen/Core>
#include <array>
#include <gradpsi/cloud.hpp>
#include <gradpsi/operator.hpp>
#include <gradpsi/scheme.hpp>

// The fields that studies differentiate, whose derivatives are known.

namespace gradpsi::apps {

/// u = offset + the product over the axes a of sin or cos(wave_number_a x_a + phase_a).
struct TestField {
  enum class Wave { Sine, Cosine };
  struct Factor {
    Wave wave;
    double wave_number;
    double phase = 0;
  };
  double offset = 0;
  std::array<Factor, 3> factors;  ///< those of axes that there are
};

/// The same cosine along every axis.
constexpr TestField cosines(double offset, double wave_number) {
  const TestField::Factor factor{TestField::Wave::Cosine, wave_number};
  return {offset, {factor, factor, factor}};
}

/// sin(2 x) cos(2.5 y) cos(2.5 z).
inline constexpr TestField smooth_field{0,
                                        {{{TestField::Wave::Sine, 2.0},
                                          {TestField::Wave::Cosine, 2.5},
                                          {TestField::Wave::Cosine, 2.5}}}};

/// A field and its derivatives at n points.
struct Exact {
  Eigen::VectorXd u;          ///< n
  Eigen::MatrixXd gradient;   ///< n x d
  Eigen::VectorXd laplacian;  ///< n
  Eigen::MatrixXd hessian;    ///< n x d(d+1)/2, in the order of components()
};
Exact exact(const TestField& field, const Positions& x);

/// The Euclidean norm of what is wrong at each point: of a gradient's components, of all d^2 entries of a Hessian.
Eigen::VectorXd errors(Derivative derivative, const Operator& op, const Exact& exact);

/// Bounds of the derivatives of order 0 .. `most` within each point's support, as error_bound() takes them:
/// n x (most + 1). The offset is left out: only differences count.
/// @param supports  n
Eigen::MatrixXd derivative_bounds(const TestField& field, const Positions& x,
                                  const Eigen::VectorXd& supports, int most);

}  // namespace gradpsi::apps
