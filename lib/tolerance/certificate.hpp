#pragma once

#include <Eigen/Core>
#include <vector>

#include "cloud/points.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/operator.hpp"
#include "schemes/targets.hpp"

namespace gradpsi {

/// @throws InvalidInput  unless they are one or n lengths whose powers are within the range of a double
void check_wavelengths(int order, int n, const VectorView& wavelengths);

/// certified_errors() of a row after another; see there. Copies share nothing.
template <int D>
class Certificate {
 public:
  Certificate(const Target& target, const Cloud& cloud);

  /// @param k           a row of op
  /// @param wavenumber  2 pi / L
  double operator()(const Operator& op, int k, double wavenumber);

 private:
  static constexpr int highest = D == 3 ? 10 : 14;  // degree of the series

  void gather(const Operator& op, int k, double wavenumber);
  void next_degree(int m);
  double series(int degrees) const;
  double worst_direction(int m) const;

  struct Monomial {
    int factor, rest;  // the number of a coordinate, and that of a monomial of the degree before
    double factorial;  // alpha!
    std::vector<int> powers;  // alpha
  };
  const Target& target_;
  const Cloud& cloud_;
  std::vector<std::vector<Monomial>> monomials_;  // by degree
  std::vector<Eigen::MatrixXd> at_directions_;    // by degree: directions x monomials

  // Of the row: offsets in units of 1 / wavenumber, weights in units of wavenumber^q.
  Eigen::MatrixXd offsets_, weights_;  // entries x D, entries x outputs
  Eigen::MatrixXd products_, last_;    // entries x monomials of this degree and of the last
  Eigen::VectorXd sizes_;              // entries: |s|^m / m!
  Eigen::VectorXd lengths_;
  std::vector<Eigen::MatrixXd> defects_;  // by degree: monomials x outputs
  std::vector<double> largest_;           // by degree: a bound of the magnitude in any direction
  double beyond_ = 0, rounding_ = 0;
};

}  // namespace gradpsi
