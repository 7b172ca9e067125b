#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "cloud/points.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/operator.hpp"
#include "schemes/targets.hpp"

namespace gradpsi {

/// @throws InvalidInput  unless they are one or n lengths whose powers are within the range of a double
void check_wavelengths(int order, int n, const VectorView& wavelengths);

/// certified_errors(), but where it is certain at once, by no more than norms of moments, that a row is good to
/// `tolerance`, or beyond doubt that it is not: there the bound is those norms. 0: everywhere to the end.
DenseVector bounded_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                           const VectorView& wavelengths, double tolerance, int threads);

/// The monomials of one degree m.
template <int D>
struct Degree {
  struct Monomial {
    int factor, rest;  // the number of a coordinate, and that of a monomial of the degree before
    double factorial;  // alpha!
    std::array<int, D> powers;  // alpha
  };
  std::vector<Monomial> monomials;
  Eigen::MatrixXd at_directions;  // directions x monomials
  double factorial;               // m!
};

/// The bound of a row after another. Copies share nothing.
template <int D>
class Certificate {
 public:
  Certificate(const Target& target, const Cloud& cloud);

  /// @param k           a row of op
  /// @param wavenumber  2 pi / L
  double operator()(const Operator& op, int k, double wavenumber, double tolerance);

 private:
  static constexpr int highest = D == 3 ? 10 : 14;  // degree of the series

  void gather(const Operator& op, int k, double wavenumber);
  void next_degree(int m);
  double all_sizes() const;
  double series(int degrees) const;
  double worst_direction(int m) const;

  const Target& target_;
  const Cloud& cloud_;
  const std::vector<Degree<D>>& degrees_;
  std::vector<Eigen::MatrixXd>
      asked_;  // by degree: monomials x outputs, what the target makes of them

  // Of the row: offsets in units of 1 / wavenumber, weights in units of wavenumber^q.
  Eigen::Index count_ = 0;
  Eigen::ArrayXXd offsets_, weights_, magnitudes_;  // entries x D, entries x outputs; |weights|
  Eigen::ArrayXXd products_, last_;          // entries x monomials of this degree and of the last
  Eigen::ArrayXd lengths_, sizes_;           // entries: |s|, |s|^m / m!
  std::vector<Eigen::MatrixXd> defects_;     // by degree: monomials x outputs
  std::array<double, highest + 1> largest_;  // by degree: a bound of the magnitude in any direction
  double beyond_ = 0, rounding_ = 0;
};

}  // namespace gradpsi
