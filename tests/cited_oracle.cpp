// Rows of the systems that the paper cites, as their papers write them: with u_i among the unknowns where it is
// fitted, with the own point in every sum, one formula after the other.

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <vector>

#include "derivatives.hpp"
#include "oracle.hpp"

namespace gradpsi {
namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

/// A point, its neighbours and itself.
struct Stencil {
  const Cloud& cloud;
  Real h;
  int i;
  const Kernel& kernel;
  std::vector<int> points = {};  // the point itself first

  int d() const { return cloud.dimension(); }
  Vector r(int j) const {
    Vector r = (cloud.positions().row(j) - cloud.positions().row(i)).transpose().cast<Real>();
    for (int a = 0; a < d(); ++a)
      if (cloud.box()[a] > 0) r[a] = std::remainder(r[a], Real(cloud.box()[a]));
    return r;
  }
  Real omega(int j) const { return cloud.volumes()[j]; }
  KernelValue W(int j) const {
    return evaluate(kernel, d(), static_cast<double>(h), static_cast<double>(r(j).norm()));
  }
  void find() {
    points = {i};
    for (int j = 0; j < cloud.size(); ++j)
      if (j != i && r(j).norm() < h) points.push_back(j);
  }

  /// 1, r, r_a r_b as far as there is room.
  Vector monomials(int j, int size) const {
    Vector p(size);
    const Vector r = this->r(j);
    p[0] = 1;
    if (size > 1) p.segment(1, d()) = r;
    for (int a = 0, k = 1 + d(); k < size; ++a)
      for (int b = a; b < d(); ++b) p[k++] = r[a] * r[b];
    return p;
  }
  /// W, its first derivatives at x_i, its second ones.
  Vector derivatives(int j, int size) const {
    Vector t(size);
    const Vector r = this->r(j);
    const KernelValue k = W(j);
    t[0] = k.w;
    t.segment(1, d()) = Real(-k.dw_over_r) * r;
    for (int a = 0, n = 1 + d(); n < size; ++a)
      for (int b = a; b < d(); ++b) {
        const Real ee = j == i ? 0 : r[a] * r[b] / r.squaredNorm();
        t[n++] = k.d2w * ee + k.dw_over_r * ((a == b) - ee);
        if (j == i) t[n - 1] = (a == b) * Real(k.d2w);
      }
    return t;
  }
};

/// What the derivative makes of 1, r_a, r_a r_b: size x outputs.
Matrix of_monomials(Derivative derivative, int d, int size) {
  const auto outputs = partials(derivative, d);
  Matrix result = Matrix::Zero(size, std::ssize(outputs));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    int k = 0;
    const auto add = [&](const Eigen::VectorXi& exponents) {
      if (k < size) result(k++, o) = of_monomial(outputs[o], exponents);
    };
    add(Eigen::VectorXi::Zero(d));
    for (int a = 0; a < d; ++a) add(Eigen::VectorXi::Unit(d, a));
    for (int a = 0; a < d; ++a)
      for (int b = a; b < d; ++b) add(Eigen::VectorXi::Unit(d, a) + Eigen::VectorXi::Unit(d, b));
  }
  return result;
}

/// Rows whose weights are coefficients of `trial` with the moments of the derivative, from function number
/// `first` on; functions before are none of either. With the condition of the system in units of h.
OracleRow by_moments(const Stencil& at, const Matrix& target, int first,
                     const std::function<Vector(int)>& trial) {
  const int size = static_cast<int>(target.rows()), m = size - first;
  Matrix M = Matrix::Zero(m, m);
  for (const int j : at.points)
    if (first == 0 || j != at.i)
      M += at.omega(j) * at.monomials(j, size).tail(m) * trial(j).tail(m).transpose();
  const Matrix C = M.fullPivLu().solve(Matrix(target.bottomRows(m)));
  OracleRow row{Eigen::MatrixXd::Zero(target.cols(), at.cloud.size()), 1};
  for (const int j : at.points)
    row.weights.col(j) = (at.omega(j) * (C.transpose() * trial(j).tail(m))).cast<double>();
  if (first > 0) {
    row.weights.col(at.i).setZero();
    row.weights.col(at.i) = -row.weights.rowwise().sum();
  }
  Vector row_scale(m), column_scale(m);
  for (int k = 0; k < m; ++k) row_scale[k] = 1 / M.row(k).cwiseAbs().maxCoeff();
  for (int k = 0; k < m; ++k)
    column_scale[k] = 1 / (row_scale.asDiagonal() * M).col(k).cwiseAbs().maxCoeff();
  const Matrix scaled = row_scale.asDiagonal() * M * column_scale.asDiagonal();
  const auto norm = [](const Matrix& A) { return A.cwiseAbs().colwise().sum().maxCoeff(); };
  row.reciprocal_condition =
      static_cast<double>(1 / (norm(scaled) * norm(scaled.fullPivLu().inverse())));
  return row;
}

/// The same less its first moments times a gradient, of which its linear functions have none then.
void take_first_moments_away(const Stencil& at, const OracleRow& gradient, OracleRow& row) {
  Eigen::MatrixXd first = Eigen::MatrixXd::Zero(row.weights.rows(), at.d());
  for (const int j : at.points) first += row.weights.col(j) * at.r(j).cast<double>().transpose();
  row.weights -= first * gradient.weights;
  row.reciprocal_condition = std::min(row.reciprocal_condition, gradient.reciprocal_condition);
}

}  // namespace

OracleRow cited_row(const Scheme& scheme, const Cloud& cloud, double h, int i,
                    const Kernel& kernel) {
  Stencil at{cloud, h, i, kernel};
  at.find();
  const int d = cloud.dimension();
  const int size = 1 + (degree(scheme) == 0 ? 0 : degree(scheme) == 1 ? d : d + d * (d + 1) / 2);
  const auto target = [&](int count) { return of_monomials(scheme.derivative, d, count); };
  const auto g = [&](int j) -> Vector { return at.derivatives(j, 1 + d).tail(d); };
  OracleRow row{Eigen::MatrixXd::Zero(target(1).cols(), cloud.size()), 1};
  auto& a = row.weights;
  switch (scheme.consistency) {
    case Consistency::Symmetric:
      for (const int j : at.points) {
        a.col(j) += (at.omega(j) * g(j)).cast<double>();
        if (j != i) a.col(i) += (at.omega(j) * g(j)).cast<double>();
      }
      return row;
    case Consistency::Normalized: {
      Vector sum = Vector::Zero(d);
      for (const int j : at.points) sum += at.omega(j) * g(j).cwiseProduct(at.r(j));
      for (const int j : at.points)
        if (j != i) a.col(j) = (at.omega(j) * g(j).cwiseQuotient(sum)).cast<double>();
      a.col(i) = -a.rowwise().sum();
      row.reciprocal_condition = static_cast<double>(sum.minCoeff() / sum.maxCoeff());
      return row;
    }
    case Consistency::Morris:
      for (const int j : at.points) {
        const Real rr = at.r(j).squaredNorm(), eta = h / 20;
        a(0, j) = static_cast<double>(at.omega(j) * 2 * g(j).dot(at.r(j)) / (rr + eta * eta));
      }
      a(0, i) = 0;
      a(0, i) = -a.sum();
      return row;
    case Consistency::Mls:
      return by_moments(at, target(size), 0,
                        [&](int j) -> Vector { return Real(at.W(j).w) * at.monomials(j, size); });
    case Consistency::Fpm:
    case Consistency::Msph:
      return by_moments(at, target(size), 0, [&](int j) { return at.derivatives(j, size); });
    case Consistency::Icspm:
      return by_moments(at, target(size), 1, [&](int j) { return at.derivatives(j, size); });
    case Consistency::Cspm: {
      const int all = 1 + d + d * (d + 1) / 2;
      row = by_moments(at, target(all), 1 + d, [&](int j) { return at.derivatives(j, all); });
      take_first_moments_away(at, oracle_row("gradient-direct-foc", cloud, h, i, kernel), row);
      return row;
    }
    case Consistency::KgfImproved: {
      Real sum = 0;
      for (const int j : at.points)
        if (j != i) sum += at.omega(j) * at.W(j).w;
      for (const int j : at.points)
        if (j != i)
          a(0, j) =
              static_cast<double>(2 * d * at.omega(j) * at.W(j).w / at.r(j).squaredNorm() / sum);
      a(0, i) = -a.sum();
      take_first_moments_away(at, cited_row("gradient-mls-1", cloud, h, i, kernel), row);
      return row;
    }
    default: return {};
  }
}

}  // namespace gradpsi
