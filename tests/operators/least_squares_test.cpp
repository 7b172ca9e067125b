// The schemes of any degree, ls-P, and least squares with the weights of the tables, soc-ls.

#include <cmath>
#include <numbers>

#include "clouds.hpp"
#include "dense.hpp"
#include "derivatives.hpp"

namespace gradpsi {
namespace {

class LeastSquares : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
  /// On the unit interval, square or cube, corners included.
  Operator assembled(const Cloud& cloud) const {
    const double ratio = support_ratio(scheme()).value_or(2.5);
    return assemble(scheme(), cloud, find_neighbours(cloud, ratio * cloud.spacing()),
                    {.on_degenerate = OnDegenerate::Widen});
  }
  Cloud cloud(double jitter, std::uint64_t seed) const {
    const int side = dimension() == 1 ? 40 : dimension() == 2 ? 14 : 8;
    return make_cloud(
        Lattice{.dimension = dimension(), .points_per_side = side, .jitter = jitter, .seed = seed});
  }
};

/// All exponents in d dimensions that add up to `total`.
std::vector<Eigen::VectorXi> exponents(int d, int total) {
  if (d == 1) return {Eigen::VectorXi::Constant(1, total)};
  std::vector<Eigen::VectorXi> all;
  for (int first = 0; first <= total; ++first)
    for (const Eigen::VectorXi& rest : exponents(d - 1, total - first)) {
      all.emplace_back(d);
      all.back() << first, rest;
    }
  return all;
}

double monomial(const Eigen::VectorXd& r, const Eigen::VectorXi& exponent) {
  double product = 1;
  for (Eigen::Index a = 0; a < r.size(); ++a) product *= std::pow(r[a], exponent[a]);
  return product;
}

// To rounding, whatever the condition number: up to 1e12 at degree 6.
TEST_P(LeastSquares, IsExactOnPolynomialsOfItsDegree) {
  const auto outputs = partials(scheme().derivative, dimension());
  for (const double jitter : {0.0, 0.2, 0.4}) {
    const Cloud cloud = this->cloud(jitter, 3);
    const Operator op = assembled(cloud);
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
      for (int i = 0; i < cloud.size(); i += dimension() == 3 ? 21 : 1)
        for (int total = 1; total <= degree(scheme()); ++total)
          for (const Eigen::VectorXi& exponent : exponents(dimension(), total)) {
            double sum = 0, size = 0;
            for (SparseMatrix::InnerIterator a(op.axes[axis], i); a; ++a) {
              const Eigen::VectorXd r =
                  (cloud.positions().row(a.col()) - cloud.positions().row(i)).transpose();
              sum += a.value() * monomial(r, exponent);
              size += std::abs(a.value()) * std::pow(r.norm(), total);
            }
            ASSERT_NEAR(sum, of_monomial(outputs[axis], exponent), 1e-11 * size)
                << "row " << i << ", exponents " << exponent.transpose();
          }
  }
}

// Least sum a^2 / w: adding a field of weights that changes no condition can only increase it, so the
// optimum is orthogonal to all such fields; a / w is a polynomial of that degree in the displacement.
TEST_P(LeastSquares, WeightsAreThePolynomialTimesTheWeightFunction) {
  const Cloud cloud = this->cloud(0.2, 5);
  const Operator op = assembled(cloud);
  const int m = unknowns(scheme(), dimension());
  const int i = cloud.size() / 2 + 1;
  const double h = op.rows.supports[i];
  Eigen::MatrixXd P(op.rows.neighbours[i], m);
  Eigen::VectorXd ratio(P.rows());
  int row = 0;
  for (SparseMatrix::InnerIterator a(op.axes[0], i); a; ++a) {
    if (a.col() == i) continue;
    const Eigen::VectorXd r =
        (cloud.positions().row(a.col()) - cloud.positions().row(i)).transpose();
    const KernelValue k = evaluate(kernels().front(), dimension(), h, r.norm());
    const double phi = scheme().weight == Weight::Kernel    ? k.w
                       : scheme().weight == Weight::Diffuse ? k.w / r.squaredNorm()
                       : scheme().weight == Weight::Mixed   ? -k.dw_over_r
                                                            : k.w / r.norm();
    ratio[row] = a.value() / phi;
    int column = 0;
    for (int total = 1; total <= degree(scheme()); ++total)
      for (const auto& exponent : exponents(dimension(), total))
        P(row, column++) = monomial(r / h, exponent);
    ++row;
  }
  // Neighbours where phi has almost vanished say little; the others agree.
  EXPECT_LT((least_squares_fit(P, ratio) - ratio).norm(), 1e-8 * ratio.norm());
}

std::vector<Scheme> least_squares_schemes() {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (scheme.consistency == Consistency::LeastSquares || scheme.consistency == Consistency::SocLs)
      chosen.push_back(scheme);
  return chosen;
}

INSTANTIATE_TEST_SUITE_P(AnyDegree, LeastSquares,
                         testing::Combine(testing::ValuesIn(least_squares_schemes()),
                                          testing::Values(1, 2)),
                         case_name);

std::vector<Scheme> up_to_degree_four() {
  auto chosen = least_squares_schemes();
  std::erase_if(chosen, [](const Scheme& s) { return degree(s) > 4; });
  return chosen;
}

INSTANTIATE_TEST_SUITE_P(UpToFour, LeastSquares,
                         testing::Combine(testing::ValuesIn(up_to_degree_four()),
                                          testing::Values(3)),
                         case_name);

/// L2 error of all components of the derivative of sin(3x) cos(2y) on the jittered unit square, boundary
/// included.
double error(const Scheme& scheme, int points_per_side) {
  const Cloud cloud = make_cloud(
      Lattice{.dimension = 2, .points_per_side = points_per_side, .jitter = 0.2, .seed = 11});
  const Eigen::ArrayXd x = cloud.positions().col(0), y = cloud.positions().col(1);
  const Eigen::VectorXd u = (3 * x).sin() * (2 * y).cos();
  const auto near = find_neighbours(cloud, *support_ratio(scheme) * cloud.spacing());
  const Operator op = assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Widen});
  const auto outputs = partials(scheme.derivative, 2);
  double squared = 0;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    Eigen::VectorXd exact = Eigen::VectorXd::Zero(cloud.size());
    for (const Eigen::VectorXi& k : outputs[o])
      exact.array() += std::pow(3, k[0]) * (3 * x + k[0] * std::numbers::pi / 2).sin() *
                       std::pow(2, k[1]) * (2 * y + k[1] * std::numbers::pi / 2).cos();
    squared += (op.axes[o] * u - exact).squaredNorm();
  }
  return std::sqrt(squared / cloud.size());
}

// With all conditions up to degree P the error of a derivative of order k falls like dx^(P + 1 - k).
TEST(LeastSquaresOrder, GrowsWithTheDegree) {
  for (const Scheme& scheme : schemes()) {
    if (scheme.consistency != Consistency::LeastSquares && scheme.consistency != Consistency::Mls)
      continue;
    if (degree(scheme) < 1 || degree(scheme) > 5) continue;  // beyond: rounding
    const double observed = std::log2(error(scheme, 32) / error(scheme, 64));
    EXPECT_NEAR(observed, degree(scheme) + 1 - order(scheme.derivative), 0.7) << name(scheme);
  }
}

}  // namespace
}  // namespace gradpsi
