// Values and derivatives at probes.

#include "gradpsi/interpolate.hpp"

#include <cmath>
#include <random>

#include "clouds.hpp"
#include "derivatives.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

std::vector<Scheme> of_degree(int degree) {
  std::vector<Scheme> result;
  for (const Scheme& scheme : schemes())
    if (scheme.consistency == Consistency::Mls && scheme.least_squares_degree == degree)
      result.push_back(scheme);
  return result;
}

Positions random_probes(int dimension, int count) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  Positions x(count, dimension);
  for (double& coordinate : x.reshaped()) coordinate = uniform(generator);
  return x;
}

/// Enough for the degree everywhere.
double support(const Cloud& cloud, int degree) {
  return std::max(rich_support(cloud), (degree + 1.5) * cloud.spacing());
}

/// Expects rows that agree to the rounding of sums in another order, in systems of that condition.
void expect_close(const Eigen::VectorXd& row, const Eigen::VectorXd& expected,
                  double reciprocal_condition, const std::string& what) {
  const double tolerance = 64 * 2.2e-16 / std::max(reciprocal_condition, 1e-9);
  EXPECT_LE((row - expected).lpNorm<Eigen::Infinity>(),
            tolerance * expected.lpNorm<Eigen::Infinity>())
      << what;
}

TEST(Interpolate, IsExactOnPolynomialsOfTheDegree) {
  for (const int d : {1, 2, 3})
    for (const int degree : {0, 1, 2, 3, 4}) {
      if (d == 3 && degree > 3) continue;
      const Cloud cloud = irregular_cloud(d, d == 1 ? 40 : d == 2 ? 16 : 11);
      Positions probes = random_probes(d, 40);
      probes.row(7) = cloud.positions().row(5);  // a point among them
      const double h = support(cloud, degree);
      const std::vector<Scheme> all = of_degree(degree);
      const auto operators = interpolate(all, cloud, probes, Eigen::VectorXd::Constant(1, h));
      ASSERT_EQ(operators.size(), all.size());
      // (k . x)^degree, whose derivatives are those of a power.
      const Eigen::VectorXd k = Eigen::VectorXd::LinSpaced(d, 0.7, 1.2);
      const Eigen::VectorXd u = (cloud.positions() * k).array().pow(degree);
      for (std::size_t r = 0; r < all.size(); ++r) {
        const auto matrices = partials(all[r].derivative, d);
        ASSERT_EQ(operators[r].axes.size(), matrices.size());
        for (std::size_t a = 0; a < matrices.size(); ++a) {
          Eigen::VectorXd expected = Eigen::VectorXd::Zero(probes.rows());
          for (const Eigen::VectorXi& partial : matrices[a]) {
            const int order = partial.sum();
            double factor = 1;
            for (int n = 0; n < order; ++n) factor *= degree - n;
            for (int b = 0; b < d; ++b) factor *= std::pow(k[b], partial[b]);
            if (order <= degree)
              expected.array() += factor * (probes * k).array().pow(degree - order);
          }
          const SparseMatrix& A = operators[r].axes[a];
          ASSERT_EQ(A.rows(), probes.rows());
          ASSERT_EQ(A.cols(), cloud.size());
          for (int i = 0; i < A.rows(); ++i) {
            const Eigen::VectorXd row = A.row(i).transpose();
            const double rounding = 1e-12 * row.lpNorm<1>() + 1e-14;
            EXPECT_NEAR(row.dot(u), expected[i], rounding) << name(all[r]) << ' ' << d << ' ' << i;
          }
        }
      }
    }
}

TEST(Interpolate, AtPointsIsWhatTheSchemeIsThere) {
  for (const int d : {1, 2, 3})
    for (const int degree : {0, 1, 2, 3}) {
      const Cloud cloud = irregular_cloud(d, d == 1 ? 30 : d == 2 ? 12 : 8);
      const Eigen::VectorXd h =
          uneven_supports(cloud).cwiseMax(support(cloud, degree)) * (degree == 3 ? 1.2 : 1);
      const std::vector<Scheme> all = of_degree(degree);
      const auto expected = assemble(all, cloud, find_neighbours(cloud, h));
      const auto operators = interpolate(all, cloud, cloud.positions(), h);
      for (std::size_t r = 0; r < all.size(); ++r)
        for (std::size_t a = 0; a < expected[r].axes.size(); ++a)
          for (int i = 0; i < cloud.size(); ++i)
            expect_close(operators[r].axes[a].row(i).transpose(),
                         expected[r].axes[a].row(i).transpose(),
                         expected[r].rows.reciprocal_condition[i], name(all[r]));
    }
}

TEST(Interpolate, ShepardsValueIsTheWeightedMean) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Positions probes = random_probes(2, 20);
  const double h = 3 * cloud.spacing();
  const Operator op = interpolate("value-mls-0", cloud, probes, Eigen::VectorXd::Constant(1, h));
  for (Eigen::Index k = 0; k < probes.rows(); ++k) {
    Eigen::VectorXd weights(cloud.size());
    for (int i = 0; i < cloud.size(); ++i) {
      const double q = (cloud.positions().row(i) - probes.row(k)).norm() / h;
      weights[i] = q < 1 ? cloud.volumes()[i] * std::pow(1 - q, 4) * (1 + 4 * q) : 0;
    }
    expect_close(op.matrix().row(k).transpose(), weights / weights.sum(), 1, "Shepard");
  }
}

TEST(Interpolate, ImagesCountInPeriodicBoxes) {
  const Cloud cloud = periodic(irregular_cloud(2, 16));
  const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, 3.2 * cloud.spacing());
  const Positions probes = random_probes(2, 60);
  Positions moved = probes;
  moved.col(0).array() -= 1;
  moved.col(1).array() += 2;
  for (const char* scheme : {"value-mls-2", "gradient-mls-2"}) {
    const Operator op = interpolate(scheme, cloud, probes, h),
                   same = interpolate(scheme, cloud, moved, h);
    for (std::size_t a = 0; a < op.axes.size(); ++a) {
      const SparseMatrix difference = op.axes[a] - same.axes[a];
      EXPECT_EQ(difference.nonZeros(), op.axes[a].nonZeros());
      EXPECT_LE(difference.norm(), 1e-11 * op.axes[a].norm());
    }
    // Rows at the edge have as many neighbours as others, about.
    EXPECT_GT(op.rows.neighbours.minCoeff(), 20);
  }
}

TEST(Interpolate, SupportsAreThoseOfTheNearestPoints) {
  const Cloud cloud =
      make_cloud({.dimension = 2, .points_per_side = 24, .jitter = 0.1, .grading = 20});
  const Eigen::VectorXd h = 3.5 * local_spacing(cloud);
  const Positions probes = random_probes(2, 50);
  const Operator op = interpolate("value-mls-1", cloud, probes, h);
  for (Eigen::Index k = 0; k < probes.rows(); ++k) {
    Eigen::Index nearest;
    const Eigen::VectorXd r = (cloud.positions().rowwise() - probes.row(k)).rowwise().norm();
    r.minCoeff(&nearest);
    EXPECT_EQ(op.rows.supports[k], h[nearest]);
    EXPECT_EQ(op.rows.neighbours[k], (r.array() < h[nearest]).count());
  }
}

TEST(Interpolate, WithoutSupportsEachProbeHasThePointsItNeeds) {
  for (const bool box : {false, true})
    for (const int d : {1, 2, 3}) {
      const Cloud open = make_cloud({.dimension = d,
                                     .points_per_side = d == 1   ? 60
                                                        : d == 2 ? 24
                                                                 : 12,
                                     .jitter = 0.2,
                                     .grading = d == 2 ? 20.0 : 1});
      const Cloud cloud = box ? periodic(open) : open;
      Positions probes = random_probes(d, 60);
      probes.row(3) = cloud.positions().row(5);
      for (const int degree : {0, 1, 2}) {
        const Scheme scheme(Derivative::Value, Weight::Kernel, Consistency::Mls, degree);
        const Operator op = interpolate(scheme, cloud, probes);
        const int count = 3 * (std::max(unknowns(scheme, d), d) + 1);
        for (Eigen::Index k = 0; k < probes.rows(); ++k) {
          Eigen::ArrayXXd r = cloud.positions().rowwise() - probes.row(k);
          if (box) r -= r.round();
          Eigen::VectorXd distances = r.matrix().rowwise().norm();
          std::ranges::sort(distances);
          EXPECT_NEAR(op.rows.supports[k], std::min(1.1 * distances[count - 1], box ? 0.5 : 9.0),
                      1e-12);
          EXPECT_EQ(op.rows.neighbours[k], (distances.array() < op.rows.supports[k]).count());
        }
        const Eigen::VectorXd u = cloud.positions().col(0).array().pow(degree);
        if (!box) {
          EXPECT_LE((op.matrix() * u - Eigen::VectorXd(probes.col(0).array().pow(degree)))
                        .lpNorm<Eigen::Infinity>(),
                    1e-11);
        }
      }
    }
}

// Columns of points ten times as near to one another as the columns: the nearest points lie in two of them.
TEST(Interpolate, WithoutSupportsALayerTakesMorePoints) {
  Positions x(20 * 41, 2);
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 41; ++j) x.row(41 * i + j) << i, 0.1 * j;
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(x.rows(), 0.1)});
  Positions probes(2, 2);
  probes << 7.4, 2.01, 12, 1;
  const Operator op = interpolate("laplacian-mls-2", cloud, probes);
  EXPECT_GT(op.rows.supports.minCoeff(), 1);
  const Eigen::VectorXd u = x.col(0).array() * x.col(1).array() + 2 * x.col(0).array().square();
  EXPECT_LE((op.matrix() * u - Eigen::VectorXd::Constant(2, 4)).lpNorm<Eigen::Infinity>(), 1e-8);
}

TEST(Interpolate, WithoutSupportsNoPointTooFew) {
  for (const int n : {1, 2, 3, 4}) {
    const Cloud cloud(random_probes(2, n), {.volumes = Eigen::VectorXd::Ones(n)});
    Positions probes(n + 1, 2);
    probes << cloud.positions(), cloud.positions().colwise().mean();
    const Operator mean = interpolate("value-mls-0", cloud, probes);
    const Eigen::VectorXd one = mean.matrix() * Eigen::VectorXd::Ones(n);
    EXPECT_LE((one.array() - 1).abs().maxCoeff(), 1e-15);
    if (n < 3) {
      EXPECT_THROW(interpolate("value-mls-1", cloud, probes), StencilError);
    }
  }
}

TEST(Interpolate, ManyProbesInOneCellAreFoundOneByOne) {
  const Cloud cloud = irregular_cloud(3, 12);
  Positions probes = 0.01 * random_probes(3, 20'000);
  probes.array() += 0.5;
  const Operator op = interpolate("value-mls-1", cloud, probes, Eigen::VectorXd::Constant(1, 0.25));
  EXPECT_LE((op.matrix() * cloud.positions() - probes).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Interpolate, WithoutVolumesTakesThoseByNumberDensity) {
  const Cloud bare(irregular_cloud(2, 14).positions());
  const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, 0.25);
  const Cloud filled(bare.positions(),
                     {.volumes = number_density_volumes(bare, find_neighbours(bare, h))});
  const Positions probes = random_probes(2, 30);
  const Operator op = interpolate("value-mls-1", bare, probes, h);
  EXPECT_EQ((op.matrix() - interpolate("value-mls-1", filled, probes, h).matrix()).norm(), 0);
  EXPECT_EQ(op.volumes, filled.volumes());
}

TEST(Interpolate, TransferThereAndBackHasTheOrderOfTheFit) {
  for (const int degree : {0, 1, 2, 3}) {
    std::vector<double> errors;
    for (const int n : {16, 32}) {
      const Cloud coarse = make_cloud({.dimension = 2, .points_per_side = n, .jitter = 0.2});
      const Cloud fine =
          make_cloud({.dimension = 2, .points_per_side = 2 * n, .jitter = 0.2, .seed = 2});
      const Scheme scheme(Derivative::Value, Weight::Kernel, Consistency::Mls, degree);
      const auto supports = [&](const Cloud& cloud) {
        return Eigen::VectorXd::Constant(1, std::max(2.5, degree + 1.0) * cloud.spacing());
      };
      const Operator up = interpolate(scheme, coarse, fine.positions(), supports(coarse));
      const Operator down = interpolate(scheme, fine, coarse.positions(), supports(fine));
      const Eigen::ArrayXd x = coarse.positions().col(0), y = coarse.positions().col(1);
      const Eigen::VectorXd u = sin(2 * x) * cos(2.5 * y);
      const Eigen::VectorXd error = down.matrix() * (up.matrix() * u) - u;
      errors.push_back(error.norm() / std::sqrt(static_cast<double>(u.size())));
    }
    EXPECT_NEAR(std::log2(errors[0] / errors[1]), degree + 1, 0.45) << degree;
  }
}

TEST(Interpolate, ConservativeTransferIsTheAdjointAndKeepsTheSum) {
  const Cloud cloud = irregular_cloud(2, 10), other = irregular_cloud(2, 17, 5);
  const Operator value = interpolate("value-mls-1", cloud, other.positions(),
                                     Eigen::VectorXd::Constant(1, 3 * cloud.spacing()));
  const SparseMatrix R = conservative_transfer(value, other.volumes());
  const Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(cloud.size(), -1, 2).array().cube(),
                        u = Eigen::VectorXd::LinSpaced(other.size(), 1, 3).array().sin();
  const double sum = u.dot(other.volumes());
  EXPECT_NEAR((R * u).dot(cloud.volumes()), sum, 1e-13);
  EXPECT_NEAR((R * u).cwiseProduct(v).dot(cloud.volumes()),
              u.cwiseProduct(value.matrix() * v).dot(other.volumes()), 1e-13);
  EXPECT_THROW(conservative_transfer(value, cloud.volumes()), InvalidInput);
}

// Nearly as many conditions as neighbours, on a lattice whose corners the probes are next to: no diagonal makes
// up for what the rows' sums lack.
TEST(Interpolate, RowsNearTheLimitSumUpToWhatTheyShould) {
  const Cloud cloud = make_cloud({.dimension = 3, .points_per_side = 9});
  Positions probes(2, 3);
  probes << 0.151, 0.0024, 0.0256, 0.0034, 0.313, 0.686;
  for (const double ratio : {4.6, 5.0}) {
    const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, ratio * cloud.spacing());
    for (const Scheme& scheme : of_degree(4)) {
      const Operator op = interpolate(scheme, cloud, probes, h);
      for (const SparseMatrix& A : op.axes)
        for (int k = 0; k < A.rows(); ++k) {
          const Eigen::VectorXd row = A.row(k).transpose();
          EXPECT_NEAR(row.sum(), scheme.derivative == Derivative::Value ? 1 : 0,
                      1e-12 * row.lpNorm<1>())
              << name(scheme) << ' ' << k << ' ' << ratio;
        }
    }
  }
}

TEST(Interpolate, TransfersAreOfValuesAndVolumes) {
  const Cloud cloud = irregular_cloud(2, 10), other = irregular_cloud(2, 8, 5);
  const Operator value = interpolate("value-mls-1", cloud, other.positions());
  const auto refusal = [&](const Operator& op, const Eigen::VectorXd& volumes) {
    return message_of<InvalidInput>([&] { return conservative_transfer(op, volumes); });
  };
  EXPECT_THAT(refusal(value, cloud.volumes()), HasSubstr("64 probes and the volumes of 100"));
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    DenseVector volumes = other.volumes();
    volumes[7] = bad;
    EXPECT_THAT(refusal(value, volumes), HasSubstr("volume of probe 7"));
  }
  for (const char* scheme : {"laplacian-mls-2", "gradient-mls-1"})
    EXPECT_THAT(refusal(interpolate(scheme, cloud, other.positions()), other.volumes()),
                HasSubstr("value-mls-P"));
}

TEST(Interpolate, NothingOfNothing) {
  const Cloud cloud = irregular_cloud(2, 8);
  const Operator op =
      interpolate("gradient-mls-1", cloud, Positions(0, 2), Eigen::VectorXd::Constant(1, 0.4));
  ASSERT_EQ(op.axes.size(), 2);
  EXPECT_EQ(op.matrix().rows(), 0);
  EXPECT_EQ(op.matrix().cols(), cloud.size());
}

std::string refusal(const Scheme& scheme, const Cloud& cloud, const Positions& probes,
                    const Eigen::VectorXd& h) {
  return message_of<InvalidInput>([&] { return interpolate(scheme, cloud, probes, h); });
}

TEST(Fault46, ProbesOutsideTheCloudAreNamedWithTheirDistance) {
  const Cloud cloud = make_cloud({.dimension = 2, .points_per_side = 10});
  const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, 0.3);
  Positions probes(5, 2);
  probes << 0.5, 0.5, 3, 0.95, 0.2, 0.3, 0.95, -4, 1.02, 1.02;  // the last one is near enough
  const std::string message = refusal("value-mls-1", cloud, probes, h);
  EXPECT_THAT(message, HasSubstr("2 of 5 probes are outside the cloud"));
  EXPECT_THAT(
      message,
      HasSubstr("probe 1 at (3, 0.95), 2.05 from point 99, where half the support is 0.15"));
  EXPECT_THAT(message, HasSubstr("probe 3 at (0.95, -4), 4.05 from point 90"));
  const Eigen::VectorXd each = Eigen::VectorXd::Constant(100, 0.3);
  EXPECT_EQ(refusal("value-mls-1", cloud, probes, each), message);
  EXPECT_THAT(refusal("value-mls-1", Cloud(Positions(0, 2), {.volumes = {}}), probes, h),
              HasSubstr("no points"));
  EXPECT_THAT(refusal("value-mls-1", cloud, probes, {}), HasSubstr("2 of 5 probes are outside"));
}

// Half a periodic box is the most that a support can be: nothing may be within it at all.
TEST(Fault46, ProbesFarFromAStripAreOutside) {
  const Positions x = irregular_cloud(2, 8).positions();
  const Cloud strip(x, {.volumes = Eigen::VectorXd::Ones(64), .box = {1, 0, 0}});
  for (const double y : {1.4, 1.6, 5.0, 1e6}) {
    const Positions probe = (Positions(1, 2) << 0.5, y).finished();
    EXPECT_THAT(refusal("value-mls-1", strip, probe, {}), HasSubstr("1 of 1 probes is outside"));
  }
}

TEST(Fault46, ProbesThatAreNoneAreNamed) {
  const Cloud cloud = irregular_cloud(2, 8);
  const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, 0.4);
  Positions probes = random_probes(2, 4);
  EXPECT_THAT(refusal("gradient-ls-2", cloud, probes, h), HasSubstr("gradient-mls-P"));
  EXPECT_THAT(refusal("value-mls-1", cloud, Positions::Zero(3, 3), h),
              HasSubstr("probes have 3 coordinates, the points 2"));
  EXPECT_THAT(refusal("value-mls-1", cloud, probes, Eigen::VectorXd::Ones(3)),
              HasSubstr("supports has 3 entries"));
  probes(2, 1) = std::nan("");
  EXPECT_THAT(refusal("value-mls-1", cloud, probes, h), HasSubstr("probe 2"));
}

TEST(Fault46, ARowThatCannotBeComputedIsNamed) {
  const Cloud cloud = irregular_cloud(2, 8);
  const double h = 1.9 * cloud.spacing();
  try {
    interpolate("value-mls-4", cloud, random_probes(2, 9), Eigen::VectorXd::Constant(1, h));
    FAIL();
  } catch (const StencilError& error) {
    EXPECT_THAT(error.what(), HasSubstr("value-mls-4 cannot be computed at probe 0: at least 14"));
    EXPECT_EQ(error.point, 0);
  }
}

}  // namespace
}  // namespace gradpsi
