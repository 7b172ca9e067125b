#include "oracle.hpp"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "derivatives.hpp"

namespace gradpsi {

bool is_cited(const Scheme& scheme) { return scheme.consistency > Consistency::LeastSquares; }

bool has_oracle(const Scheme& scheme) {
  return degree(scheme) <= 2 && scheme.consistency != Consistency::Positive &&
         scheme.consistency != Consistency::Rkpm && scheme.consistency != Consistency::Kgf;
}

OracleRow oracle_row(const Scheme& scheme, const Cloud& cloud, double h, int i,
                     const Kernel& kernel) {
  if (is_cited(scheme)) return cited_row(scheme, cloud, h, i, kernel);
  using Real = long double;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  const int d = cloud.dimension();
  const int m = d + d * (d + 1) / 2;
  const bool gradient = scheme.derivative == Derivative::Gradient;
  const int unknowns = degree(scheme) == 1 ? d : m;
  // Whether weights and conditions are made of the same monomials.
  const bool symmetric = gradient || scheme.consistency != Consistency::Soc;

  const auto r_ij = [&](int j) -> Vector {
    Vector r = (cloud.positions().row(j) - cloud.positions().row(i)).transpose().cast<Real>();
    for (int a = 0; a < d; ++a)
      if (cloud.box()[a] > 0) r[a] = std::remainder(r[a], Real(cloud.box()[a]));
    return r;
  };
  const auto phi = [&](Real r) -> Real {
    const KernelValue k = evaluate(kernel, d, h, static_cast<double>(r));
    switch (scheme.weight) {
      case Weight::Direct: return gradient ? -k.dw_over_r : k.d2w + (d - 1) * k.dw_over_r;
      case Weight::Diffuse: return (gradient ? d : 2 * d) * k.w / (r * r);
      case Weight::DiffuseNs: return (gradient ? 1 : 2) * k.w / r;
      case Weight::Mixed: return -2 * k.dw_over_r;
      case Weight::Kernel: return k.w;
      case Weight::Distance:
      case Weight::Derivatives: break;
    }
    return 0;
  };
  // Linear terms, then the upper triangle of r r^T, the latter divided by `divisor`.
  const auto monomials = [&](const Vector& r, Real divisor) {
    Vector p(unknowns);
    p.head(d) = r;
    for (int a = 0, row = d; row < unknowns; ++a)
      for (int b = a; b < d; ++b) p[row++] = r[a] * r[b] / divisor;
    return p;
  };

  Matrix M = Matrix::Zero(unknowns, unknowns);
  const auto outputs = partials(scheme.derivative, d);
  Matrix rhs = Matrix::Zero(unknowns, std::ssize(outputs));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    for (int a = 0; a < d; ++a) rhs(a, o) = of_monomial(outputs[o], Eigen::VectorXi::Unit(d, a));
    for (int a = 0, row = d; row < unknowns; ++a)
      for (int b = a; b < d; ++b)
        rhs(row++, o) =
            of_monomial(outputs[o], Eigen::VectorXi::Unit(d, a) + Eigen::VectorXi::Unit(d, b));
  }
  std::vector<int> near;
  for (int j = 0; j < cloud.size(); ++j)
    if (j != i && r_ij(j).norm() < h) near.push_back(j);
  const auto trial = [&](const Vector& r) {
    return monomials(r, symmetric ? Real(1) : r.squaredNorm());
  };
  for (const int j : near) {
    const Vector r = r_ij(j);
    M += Real(cloud.volumes()[j]) * phi(r.norm()) * monomials(r, 1) * trial(r).transpose();
  }
  const Matrix C = M.fullPivLu().solve(rhs);

  Eigen::MatrixXd row = Eigen::MatrixXd::Zero(std::ssize(outputs), cloud.size());
  for (const int j : near) {
    const Vector r = r_ij(j);
    const Real weight = Real(cloud.volumes()[j]) * phi(r.norm());
    Vector a = Vector::Ones(1);
    if (scheme.consistency != Consistency::Zoc) {
      a = C.transpose() * trial(r);
    } else if (gradient) {
      a = r;
    } else if (scheme.derivative == Derivative::Hessian) {
      a.resize(std::ssize(outputs));
      for (int k = 0, n = 0; k < d; ++k)
        for (int l = k; l < d; ++l)
          a[n++] = ((d + 2) * r[k] * r[l] / r.squaredNorm() - (k == l)) / 2;
    }
    row.col(j) = (weight * a).cast<double>();
    row.col(i) -= row.col(j);
  }

  if (scheme.consistency == Consistency::Zoc) return {row, 1};
  Vector p_unit = Vector::Ones(unknowns), t_unit = Vector::Ones(unknowns);
  for (int k = 0; k < unknowns; ++k) {
    p_unit[k] = k < d ? h : h * h;
    t_unit[k] = k < d ? h : symmetric ? h * h : 1;
  }
  const Matrix scaled = p_unit.cwiseInverse().asDiagonal() * M * t_unit.cwiseInverse().asDiagonal();
  const auto norm = [](const Matrix& A) { return A.cwiseAbs().colwise().sum().maxCoeff(); };
  const Matrix inverse = scaled.fullPivLu().inverse();
  return {row, static_cast<double>(1 / (norm(scaled) * norm(inverse)))};
}

}  // namespace gradpsi
