// Row reports, error bounds, spectra and the forecast of growth.

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "clouds.hpp"
#include "derivatives.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

std::vector<int> all_points(const Cloud& cloud) {
  std::vector<int> points(cloud.size());
  std::iota(points.begin(), points.end(), 0);
  return points;
}

class Diagnosis : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
  Cloud cloud() const {
    return irregular_cloud(dimension(), dimension() == 1 ? 40 : dimension() == 2 ? 14 : 7, 3);
  }
  Operator assembled(const Cloud& cloud) const {
    const double ratio = std::max(2.9, support_ratio(scheme()).value_or(0));
    return assemble(scheme(), cloud, find_neighbours(cloud, ratio * cloud.spacing()),
                    {.on_degenerate = OnDegenerate::Zero});
  }
  /// The least that a value's moments of degree k are rounded by, its own weight being about 1.
  double of_itself(double support, int k) const {
    return scheme().derivative == Derivative::Value ? 1e-3 * std::pow(support, k) : 0;
  }
};

// For a wave every derivative is known: |D^k u| <= |wave vector|^k. Short and long ones, so that each
// order of the expansion matters; the shortest has half a dozen points a wave length.
TEST_P(Diagnosis, TheErrorOfAWaveIsWithinItsBoundInEveryRow) {
  const Cloud cloud = this->cloud();
  const Operator op = assembled(cloud);
  const RowDiagnosis rows = diagnose(scheme(), cloud, op);
  for (const double wave_number : {0.0, 0.1, 1.0, 3.0, 10.0}) {
    Eigen::VectorXd direction = Eigen::Vector3d(3, -2, 1).head(dimension()).normalized();
    const Eigen::VectorXd k = wave_number * direction;
    const Eigen::ArrayXd phase = (cloud.positions() * k).array() + 0.4;
    const Eigen::VectorXd u = phase.sin();
    Eigen::MatrixXd bounds(1, rows.remainders.cols());
    for (Eigen::Index l = 0; l < bounds.cols(); ++l)
      bounds(0, l) = std::pow(wave_number, static_cast<double>(l));
    const Eigen::VectorXd bound = error_bound(rows, bounds);
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
      const Partials output = partials(scheme().derivative, dimension())[axis];
      const Eigen::VectorXd exact =
          phase.unaryExpr([&](double at) { return of_wave(output, k, at); }).matrix();
      const Eigen::VectorXd error = (op.axes[axis] * u - exact).cwiseAbs();
      // Coordinates of size 1 are rounded too, by 1e-16.
      for (int i = 0; i < cloud.size(); ++i)
        EXPECT_LE(error[i], bound[i] * (1 + 1e-12) + 1e-13 * wave_number * rows.remainders(i, 0))
            << "row " << i << ", wave number " << wave_number;
    }
  }
}

TEST_P(Diagnosis, PromisedConditionsLeaveRounding) {
  const Cloud cloud = this->cloud();
  const Operator op = assembled(cloud);
  const RowDiagnosis rows = diagnose(scheme(), cloud, op);
  for (int i = 0; i < cloud.size(); ++i)
    for (int k = 0; k <= op.rows.degree[i]; ++k)
      EXPECT_LE(rows.residuals(i, k),
                1e-13 / std::max(1e-6, op.rows.reciprocal_condition[i]) *
                    (rows.remainders(i, k) + of_itself(op.rows.supports[i], k)))
          << "row " << i << ", degree " << k;
}

std::vector<Scheme> every_scheme_to_degree_four() {
  std::vector<Scheme> chosen(schemes().begin(), schemes().end());
  std::erase_if(chosen, [](const Scheme& s) { return degree(s) > 4; });
  return chosen;
}
INSTANTIATE_TEST_SUITE_P(Rows, Diagnosis,
                         testing::Combine(testing::ValuesIn(every_scheme_to_degree_four()),
                                          testing::Values(1, 2, 3)),
                         case_name);

// Theory: dx^2 sum |psi| of the five-point Laplacian is 4, its error dx^2 / 12 per fourth derivative.
TEST(Diagnosis, TheFivePointLaplacianIsKnown) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 10, .periodic = true});
  const Operator op = assemble("laplacian-positive", cloud, find_neighbours(cloud, 0.25));
  const RowDiagnosis rows = diagnose("laplacian-positive", cloud, op);
  EXPECT_NEAR(rows.amplification.maxCoeff(), 4, 1e-12);
  EXPECT_EQ(rows.negative_share.maxCoeff(), 0);
  EXPECT_NEAR(rows.residuals.col(3).maxCoeff(), 0, 1e-14);  // symmetric: third moments vanish
  EXPECT_NEAR(rows.remainders(7, 3), 4 * 0.1 / 6, 1e-13);
  const MatrixSummary matrix = summarise(op.matrix(), op.volumes);
  EXPECT_TRUE(matrix.symmetric && matrix.dominant && matrix.m_matrix);
  EXPECT_NEAR(matrix.leftmost, -800, 1e-9);
  EXPECT_EQ(matrix.bandwidth, 90);  // around the periodic box
  // Eigenvalues -(4 / dx^2) (sin^2 + sin^2), the largest -800: Euler 2 / 800, RK4 2.785 / 800.
  const Spectrum all = spectrum(op.matrix(), op.volumes);
  EXPECT_TRUE(all.complete);
  EXPECT_NEAR(all.leftmost(), -800, 1e-9);
  EXPECT_NEAR(all.rightmost(), 0, 1e-9);
  EXPECT_FALSE(all.grows());
  EXPECT_NEAR(largest_stable_step(all, Stepper::Euler), 2.0 / 800, 1e-12);
  EXPECT_NEAR(largest_stable_step(all, Stepper::RungeKutta4) * 800, 2.785293563, 1e-8);
  EXPECT_TRUE(singular_steps(all).empty());
}

// Whatever the method: the powers' sums are the powers' traces. In units in which squares overflow, too.
TEST(Spectrum, HasTheTracesOfThePowers) {
  std::srand(7);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(23, 23);
  const ComplexVector values = spectrum(sparse(A)).values;
  EXPECT_GT(values.imag().maxCoeff(), 0.5);
  Eigen::MatrixXd power = A;
  for (int k = 1; k <= 4; ++k, power *= A)
    EXPECT_LT(std::abs(values.array().pow(k).sum() - power.trace()), 1e-10 * power.norm()) << k;
  const ComplexVector large = spectrum(sparse(1e200 * A)).values;
  EXPECT_LT((large / 1e200 - values).norm(), 1e-10);
  const Eigen::MatrixXd S = A + A.transpose();
  const DenseVector ones = DenseVector::Ones(23);
  const ComplexVector real = spectrum(sparse(S), ones).values;
  EXPECT_LT(std::abs(real.array().square().sum() - S.squaredNorm()), 1e-10 * S.squaredNorm());
  EXPECT_LT((spectrum(sparse(1e200 * S), ones).values / 1e200 - real).norm(), 1e-10);
}

// A rotation scaled by 3: eigenvalues +-3i. Euler amplifies at any step; RK4 does not up to 2 sqrt(2).
TEST(Spectrum, OfARotationAllowsRungeKuttaStepsOnly) {
  const Spectrum pair = spectrum(sparse(Eigen::Matrix2d{{-1e-9, 3}, {-3, -1e-9}}));
  EXPECT_NEAR(pair.widest(), 3, 1e-12);
  EXPECT_LT(largest_stable_step(pair, Stepper::Euler), 1e-2);
  EXPECT_NEAR(3 * largest_stable_step(pair, Stepper::RungeKutta4), 2 * std::sqrt(2.0), 1e-3);
}

// With half the step the error falls by 2^2 and by 2^5, but for terms of the next order, about |z| / 10.
TEST(Spectrum, GrowthFactorsAreExponentialsUpToTheOrderOfTheMethod) {
  const std::complex<double> z(-0.1, 0.2);
  for (const auto& [stepper, order] :
       {std::pair(Stepper::Euler, 1), std::pair(Stepper::RungeKutta4, 4)}) {
    const double whole = std::abs(growth_factor(stepper, z) - std::exp(z));
    const double half = std::abs(growth_factor(stepper, z / 2.0) - std::exp(z / 2.0));
    EXPECT_NEAR(std::log2(whole / half), order + 1, 0.1);
  }
}

TEST(Spectrum, PositiveEigenvaluesMakeImplicitStepsSingular) {
  const Spectrum two = spectrum(sparse(Eigen::Matrix3d{{4, 1, 0}, {0, -2, 5}, {0, 0, 0.5}}));
  EXPECT_TRUE(two.grows());
  EXPECT_EQ(largest_stable_step(two, Stepper::RungeKutta4), 0);
  const std::vector<double> steps = singular_steps(two);
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_NEAR(steps[0], 0.25, 1e-12);
  EXPECT_NEAR(steps[1], 2, 1e-12);
}

TEST(Spectrum, IterationFindsTheEndsOfTheDenseOne) {
  const Cloud cloud = irregular_cloud(2, 18, 5);
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  for (const char* name : {"laplacian-mixed-zoc", "laplacian-mixed-soc", "laplacian-direct-zoc"}) {
    const Operator op = assemble(name, cloud, near);
    const Spectrum dense = spectrum(op.matrix()), ends = spectrum(op.matrix(), {}, 0);
    EXPECT_FALSE(ends.complete);
    const double span = dense.rightmost() - dense.leftmost();
    EXPECT_NEAR(ends.rightmost(), dense.rightmost(), 1e-6 * span) << name;
    EXPECT_NEAR(ends.leftmost(), dense.leftmost(), 1e-6 * span) << name;
  }
}

TEST(Spectrum, SymmetryDoesNotChangeIt) {
  const Cloud cloud = irregular_cloud(2, 10, 5);
  const Operator op =
      assemble("laplacian-direct-zoc", cloud, find_neighbours(cloud, 3 * cloud.spacing()));
  const Spectrum general = spectrum(op.matrix()), symmetric = spectrum(op.matrix(), op.volumes);
  EXPECT_NEAR(general.rightmost(), symmetric.rightmost(), 1e-9 * -general.leftmost());
  EXPECT_NEAR(general.leftmost(), symmetric.leftmost(), 1e-9 * -general.leftmost());
  EXPECT_EQ(symmetric.widest(), 0);
}

// Where every interior row has a positive stencil nothing grows, with periodic or Dirichlet walls.
TEST(Forecast, PositiveStencilsNeverGrow) {
  for (const int d : {1, 2, 3})
    for (const double jitter : {0.2, 0.4})
      for (const bool periodic : {true, false}) {
        const int side = d == 1 ? 40 : d == 2 ? 14 : 6;
        const Cloud cloud = make_cloud(Lattice{
            .dimension = d, .points_per_side = side, .jitter = jitter, .periodic = periodic});
        const Operator op =
            assemble("laplacian-positive", cloud, find_neighbours(cloud, 2.8 / side),
                     {.on_degenerate = OnDegenerate::Zero});
        std::vector<int> with_stencil;
        for (int i = 0; i < cloud.size(); ++i)
          if (op.rows.outcome[i] == RowOutcome::AsAsked) with_stencil.push_back(i);
        const Forecast told = forecast(cloud, op.matrix(), with_stencil, op.volumes);
        EXPECT_TRUE(told.certain && !told.grows);
        const Spectrum all = spectrum(principal_part(op.matrix(), with_stencil));
        EXPECT_LE(all.rightmost(), 1e-12 * -all.leftmost());
      }
}

// Most rows of a small cube have no positive stencil and stay zero: that is no reason to call rounding growth.
TEST(Forecast, ZeroRowsAreNoScale) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 3, .points_per_side = 6, .jitter = 0.2});
  const Operator op = assemble("laplacian-positive", cloud, find_neighbours(cloud, 3.0 / 6),
                               {.on_degenerate = OnDegenerate::Zero});
  ASSERT_GT(op.rows.degenerate(), cloud.size() / 2);
  EXPECT_FALSE(spectrum(op.matrix()).grows());
}

// What theory and the study say, against eigenvalues: a cloud that just ends lets second order grow, and
// uncorrected schemes do not.
TEST(Forecast, AgreesWithTheSpectrum) {
  const Cloud cloud = make_cloud(Lattice{.dimension = 2, .points_per_side = 14, .jitter = 0.3});
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  std::vector<int> inner;
  for (int i = 0; i < cloud.size(); ++i)
    if (i % 14 != 0 && i % 14 != 13 && i / 14 != 0 && i / 14 != 13) inner.push_back(i);
  int growing = 0;
  for (const Scheme& scheme : schemes()) {
    if (scheme.derivative != Derivative::Laplacian) continue;
    const Operator op = assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Widen});
    for (const auto& points : {inner, all_points(cloud)}) {
      const Forecast told = forecast(cloud, op.matrix(), points, op.volumes);
      const Spectrum all = spectrum(principal_part(op.matrix(), points));
      // MSPH is the steadiest that is not positive: what would let others grow does not yet.
      const bool steady = scheme == Scheme("laplacian-msph") && !all.grows();
      EXPECT_TRUE(steady || told.grows == all.grows()) << name(scheme) << ", " << points.size();
      EXPECT_TRUE(!all.grows() || told.rate > 0.3 * all.rightmost()) << name(scheme);
      growing += all.grows();
    }
  }
  EXPECT_GT(growing, 8);
}

TEST(Forecast, SymmetricGrowthIsCertain) {
  const Cloud cloud = irregular_cloud(2, 12, 5);
  const Operator op =
      assemble("laplacian-direct-zoc", cloud, find_neighbours(cloud, 3 * cloud.spacing()));
  const Forecast told = forecast(cloud, op.matrix(), all_points(cloud), op.volumes);
  EXPECT_TRUE(told.grows && told.certain);
  // Interlacing: the block's eigenvalue is a lower bound of the matrix's.
  EXPECT_LE(told.rate, spectrum(op.matrix(), op.volumes).rightmost() * (1 + 1e-12));
  EXPECT_GE(told.point, 0);
}

/// Second differences on a line whose ends are held; row i has a negative weight.
SparseMatrix line_with_a_negative_weight(int n, int i) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  A.diagonal().setConstant(-2);
  A.diagonal(1).setConstant(1);
  A.diagonal(-1).setConstant(1);
  A(i, i + 2) = -0.01;
  A(i, i) += 0.01;
  return sparse(A);
}

// Near the end the row has neighbours with something to spare; far from it nothing is proved.
TEST(Forecast, DiscsThatAScalingMovesToTheLeftAreCertain) {
  constexpr int n = 200;
  const Cloud cloud = make_cloud(Lattice{.dimension = 1, .points_per_side = n});
  for (const int i : {2, n / 2}) {
    const SparseMatrix A = line_with_a_negative_weight(n, i);
    ASSERT_FALSE(summarise(A, DenseVector::Ones(n)).dominant);
    const Forecast told = forecast(cloud, A, all_points(cloud), DenseVector::Ones(n));
    EXPECT_EQ(told.certain, i == 2);
    EXPECT_FALSE(told.grows);
    EXPECT_LT(spectrum(A).rightmost(), 0);
  }
}

TEST(Forecast, OfFewPointsIsTheirSpectrum) {
  const Cloud cloud = irregular_cloud(2, 10, 5);
  const Operator op =
      assemble("laplacian-mixed-soc", cloud, find_neighbours(cloud, 3 * cloud.spacing()));
  const Forecast told = forecast(cloud, op.matrix(), all_points(cloud), op.volumes);
  EXPECT_TRUE(told.grows && told.certain);
  EXPECT_NEAR(told.rate, spectrum(op.matrix()).rightmost(), 1e-9 * told.rate);
}

TEST(Diagnosis, SizesAreChecked) {
  const Cloud cloud = irregular_cloud(2, 8);
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  const Operator part = assemble("laplacian-mixed-soc", cloud, near, {.rows = std::vector<int>{1}});
  EXPECT_THROW(diagnose("laplacian-mixed-soc", cloud, part), InvalidInput);
  const Operator op = assemble("laplacian-mixed-soc", cloud, near);
  const RowDiagnosis rows = diagnose("laplacian-mixed-soc", cloud, op);
  EXPECT_THROW(error_bound(rows, Eigen::MatrixXd::Ones(1, 3)), InvalidInput);
  EXPECT_THROW(error_bound(rows, Eigen::MatrixXd::Ones(2, rows.remainders.cols())), InvalidInput);
  EXPECT_THROW(summarise(op.matrix(), Eigen::VectorXd::Ones(3)), InvalidInput);
  EXPECT_THROW(spectrum(part.matrix()), InvalidInput);
  EXPECT_THROW(principal_part(op.matrix(), {3, 2}), InvalidInput);
  EXPECT_THROW(principal_part(op.matrix(), {0, 64}), InvalidInput);
  EXPECT_THROW(forecast(cloud, op.matrix(), {0, 1}, Eigen::VectorXd::Ones(3)), InvalidInput);
}

TEST(Diagnosis, NoPointsAreNothingToSay) {
  const Cloud none(Positions(0, 2));
  const Operator op = assemble("laplacian-mixed-soc", none, find_neighbours(none, 1.0));
  EXPECT_EQ(diagnose("laplacian-mixed-soc", none, op).amplification.size(), 0);
  EXPECT_EQ(spectrum(op.matrix()).values.size(), 0);
  EXPECT_FALSE(forecast(none, op.matrix(), {}, op.volumes).grows);
}

}  // namespace
}  // namespace gradpsi
