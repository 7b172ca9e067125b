// Rows chosen to a tolerance, and the proof that they are good to it.

#include "gradpsi/tolerance.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <random>

#include "base/cpu.hpp"
#include "clouds.hpp"
#include "gradpsi/error.hpp"
#include "schemes/targets.hpp"
#include "tolerance/candidates.hpp"
#include "tolerance/certificate.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

/// What row k makes of the wave e^(i k . (x - x_k)) less the symbol, by the definition.
double error_of_wave(Derivative derivative, const Cloud& cloud, const Operator& op, int k,
                     const Eigen::VectorXd& wave) {
  const Target& target = gradpsi::target(derivative);
  const int d = cloud.dimension(), i = op.point(k);
  double squares = 0;
  for (int o = 0; o < std::ssize(op.axes); ++o) {
    std::complex<double> sum = 0;
    for (SparseMatrix::InnerIterator a(op.axes[o], k); a; ++a) {
      const Eigen::VectorXd r =
          (cloud.positions().row(static_cast<int>(a.col())) - cloud.positions().row(i)).transpose();
      sum += a.value() * std::polar(1.0, wave.dot(r));
    }
    // i k_a, -k_a k_b, -|k|^2: the derivative of the wave at the point.
    std::complex<double> symbol = 0;
    std::vector<int> powers(d, 0);
    for (int a = 0; a < d; ++a) {
      if (target.order == 1) {
        powers.assign(d, 0), powers[a] = 1;
        symbol += std::complex<double>(0, wave[a]) * target.of(o, powers);
        continue;
      }
      for (int b = a; b < d; ++b) {
        powers.assign(d, 0), ++powers[a], ++powers[b];
        symbol -= wave[a] * wave[b] / (a == b ? 2 : 1) * target.of(o, powers);
      }
    }
    squares += std::norm(sum - symbol);
  }
  return std::sqrt(squares);
}

/// The largest of many waves of length L and longer.
double sampled_error(Derivative derivative, const Cloud& cloud, const Operator& op, int k, double L,
                     std::mt19937& random, int waves) {
  const double shortest = 2 * std::numbers::pi / L;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  double worst = 0;
  for (int w = 0; w < waves; ++w) {
    Eigen::VectorXd wave(cloud.dimension());
    for (double& a : wave) a = normal(random);
    wave *= shortest / wave.norm() * (w % 2 == 0 ? 1 : part(random));
    worst = std::max(worst, error_of_wave(derivative, cloud, op, k, wave));
  }
  return worst / std::pow(shortest, order(derivative));
}

const std::vector<const char*> several = {"laplacian-ls-2", "laplacian-mixed-zoc", "laplacian-ls-4",
                                          "gradient-ls-1",  "gradient-symmetric",  "gradient-ls-3",
                                          "hessian-ls-2",   "laplacian-mixed-soc"};

TEST(Certificate, IsNeverBroken) {
  std::mt19937 random(1);
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(d, d == 1 ? 60 : d == 2 ? 14 : 7);
    for (const Scheme scheme : several) {
      const Operator op = assemble(scheme, cloud, find_neighbours(cloud, 2.9 * cloud.spacing()),
                                   {.on_degenerate = OnDegenerate::Zero});
      for (const double spacings : {3.0, 8.0, 40.0}) {
        const double L = spacings * cloud.spacing();
        const DenseVector errors =
            certified_errors(scheme.derivative, cloud, op, DenseVector::Constant(1, L));
        for (int k = 0; k < cloud.size(); k += 3)
          EXPECT_LE(sampled_error(scheme.derivative, cloud, op, k, L, random, 60), errors[k])
              << name(scheme) << " row " << k << ", " << d << "D, L = " << spacings;
      }
    }
  }
}

// Of those that assemble_to() chooses from; where a scheme errs at several degrees of the same parity, as zoc does,
// these may cancel one another, which a sum of magnitudes cannot see.
TEST(Certificate, IsCloseToTheWorstWave) {
  std::mt19937 random(2);
  const std::vector<const char*> chosen = {"laplacian-positive", "laplacian-ls-2", "laplacian-ls-4",
                                           "gradient-ls-1",      "gradient-ls-3",  "hessian-ls-2"};
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(d, d == 1 ? 60 : d == 2 ? 14 : 7);
    for (const Scheme scheme : chosen) {
      const Operator op = assemble(scheme, cloud, find_neighbours(cloud, 2.9 * cloud.spacing()),
                                   {.on_degenerate = OnDegenerate::Zero});
      const double L = 16 * cloud.spacing();
      const DenseVector errors =
          certified_errors(scheme.derivative, cloud, op, DenseVector::Constant(1, L));
      for (int k = 0; k < cloud.size(); k += 9) {
        if (!std::isfinite(errors[k])) continue;
        const double found =
            sampled_error(scheme.derivative, cloud, op, k, L, random, d == 3 ? 1000 : 300);
        EXPECT_LE(errors[k], 1.5 * found) << name(scheme) << " row " << k << ", " << d << "D";
      }
    }
  }
}

/// Calls law(bounds, all): bounds(rows, processor) of some rows, and all rows.
template <class Law>
void for_several_operators(const Law& law) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = irregular_cloud(d, d == 1 ? 61 : d == 2 ? 13 : 6);
    const Neighbours near = find_neighbours(cloud, 2.9 * cloud.spacing());
    const DenseVector L = DenseVector::Constant(1, 9 * cloud.spacing());
    for (const Scheme scheme : several)
      for (const double tolerance : {0.0, 0.02}) {
        const auto bounds = [&](const std::vector<int>& rows, const Cpu& processor) {
          return bounded_errors(
              scheme.derivative, cloud,
              assemble(scheme, cloud, near, {.on_degenerate = OnDegenerate::Zero, .rows = rows}), L,
              tolerance, 1, processor);
        };
        std::vector<int> all(cloud.size());
        std::iota(all.begin(), all.end(), 0);
        SCOPED_TRACE(name(scheme) + ' ' + std::to_string(d) + "D");
        law(bounds, all);
      }
  }
}

void expect_same(const DenseVector& found, const DenseVector& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (int k = 0; k < found.size(); ++k) {
    if (found[k] == expected[k]) continue;  // infinity
    EXPECT_NEAR(found[k], expected[k], 1e-11 * expected[k]) << "row " << k;
  }
}

TEST(Certificate, IsTheSameOnAllProcessors) {
  for_several_operators([](const auto& bounds, const std::vector<int>& all) {
    const DenseVector narrowest = bounds(all, runnable_cpus().front());
    for (const Cpu& processor : runnable_cpus()) expect_same(bounds(all, processor), narrowest);
  });
}

// Series end where they are good enough, those of each row at a degree of its own.
TEST(Certificate, OfARowDoesNotDependOnTheOthers) {
  for_several_operators([](const auto& bounds, const std::vector<int>& all) {
    std::vector<int> part;
    for (const int i : all)
      if (i % 3 == 0) part.push_back(i);
    expect_same(bounds(part, cpu()), bounds(all, cpu())(part));
  });
}

class Chosen : public testing::TestWithParam<std::tuple<int, Derivative>> {
 protected:
  const Cloud cloud_ = irregular_cloud(dimension(), dimension() == 3 ? 6 : 14);
  int dimension() const { return std::get<0>(GetParam()); }
  Derivative derivative() const { return std::get<1>(GetParam()); }
  Accuracy accuracy(double tolerance) const {
    return {tolerance, DenseVector::Constant(1, 14 * cloud_.spacing())};
  }
};

TEST_P(Chosen, RowsAreWithinTheToleranceOrSaySo) {
  std::mt19937 random(3);
  for (const double tolerance : {0.3, 0.03}) {
    const Operator op =
        assemble_to(accuracy(tolerance), derivative(), cloud_, {.on_miss = OnDegenerate::Lower});
    ASSERT_EQ(std::ssize(op.rows.schemes), cloud_.size());
    for (int i = 0; i < cloud_.size(); ++i) {
      ASSERT_TRUE(op.rows.schemes[i].has_value());
      EXPECT_EQ(op.rows.errors[i] <= tolerance, op.rows.outcome[i] == RowOutcome::AsAsked);
      EXPECT_LE(sampled_error(derivative(), cloud_, op, i, accuracy(1).wavelengths[0], random, 10),
                op.rows.errors[i]);
    }
  }
}

// Each row is what the scheme that it names gives on the support that it names.
TEST_P(Chosen, RowsAreThoseOfTheirSchemes) {
  const Operator op =
      assemble_to(accuracy(0.1), derivative(), cloud_, {.on_miss = OnDegenerate::Lower});
  const Neighbours near = find_neighbours(cloud_, op.rows.supports);
  Cloud with_volumes(cloud_.positions(), {.volumes = op.volumes});
  for (const Scheme& scheme : schemes()) {
    std::vector<int> rows;
    for (int i = 0; i < cloud_.size(); ++i)
      if (op.rows.schemes[i] == scheme) rows.push_back(i);
    if (rows.empty()) continue;
    const Operator own = assemble(scheme, with_volumes, near, {.rows = rows});
    for (std::size_t k = 0; k < rows.size(); ++k)
      for (std::size_t a = 0; a < op.axes.size(); ++a) {
        const Eigen::VectorXd expected = own.axes[a].row(static_cast<int>(k)).transpose(),
                              found = op.axes[a].row(rows[k]).transpose();
        EXPECT_LE((found - expected).norm(), 1e-10 * expected.norm()) << name(scheme);
      }
  }
}

TEST_P(Chosen, DoNotDependOnThreads) {
  const Operator one = assemble_to(accuracy(0.1), derivative(), cloud_,
                                   {.on_miss = OnDegenerate::Lower, .threads = 1});
  const Operator three = assemble_to(accuracy(0.1), derivative(), cloud_,
                                     {.on_miss = OnDegenerate::Lower, .threads = 3});
  for (std::size_t a = 0; a < one.axes.size(); ++a)
    EXPECT_EQ((one.axes[a] - three.axes[a]).norm(), 0);
  EXPECT_EQ(one.rows.errors, three.rows.errors);
}

// A smaller tolerance takes no fewer entries, and a larger one none that are more.
TEST_P(Chosen, EntriesGrowWithTheAccuracyAskedFor) {
  Eigen::Index before = 0;
  for (const double tolerance : {1.0, 0.1, 0.01}) {
    const Operator op =
        assemble_to(accuracy(tolerance), derivative(), cloud_, {.on_miss = OnDegenerate::Lower});
    EXPECT_GT(op.matrix().nonZeros(), before);
    before = op.matrix().nonZeros();
  }
}

TEST_P(Chosen, MissedRowsAreAnErrorThatNamesATolerance) {
  const double tight = 1e-9;
  std::string said;
  try {
    assemble_to(accuracy(tight), derivative(), cloud_);
    FAIL() << "nothing was thrown";
  } catch (const StencilError& error) {
    said = error.what();
  }
  EXPECT_THAT(said, HasSubstr("no row is good to 1e-09 at point 0"));
  const std::string before = "all rows meet a tolerance of ";
  ASSERT_THAT(said, HasSubstr(before));
  const double told = std::stod(said.substr(said.find(before) + before.size()));
  EXPECT_NO_THROW(assemble_to(accuracy(told), derivative(), cloud_)) << said;
  const Operator none =
      assemble_to(accuracy(tight), derivative(), cloud_, {.on_miss = OnDegenerate::Zero});
  EXPECT_EQ(none.rows.outcome[0], RowOutcome::Zero);
  EXPECT_FALSE(none.rows.schemes[0].has_value());
  EXPECT_EQ(none.matrix().coeff(0, 0), 0);
}

INSTANTIATE_TEST_SUITE_P(Tolerance, Chosen,
                         testing::Combine(testing::Values(1, 2, 3),
                                          testing::Values(Derivative::Gradient,
                                                          Derivative::Laplacian,
                                                          Derivative::Hessian)),
                         [](const auto& chosen) {
                           return std::string(name(std::get<1>(chosen.param))) + "_" +
                                  std::to_string(std::get<0>(chosen.param)) + "d";
                         });

/// Points of a square whose outermost ones are fixed.
std::vector<int> outermost(const Cloud& cloud, double width) {
  std::vector<int> points;
  for (int i = 0; i < cloud.size(); ++i)
    if (const auto x = cloud.positions().row(i).array();
        x.minCoeff() < width || x.maxCoeff() > 1 - width)
      points.push_back(i);
  return points;
}

std::vector<int> others(const Cloud& cloud, const std::vector<int>& points) {
  std::vector<int> result;
  for (int i = 0; i < cloud.size(); ++i)
    if (!std::ranges::binary_search(points, i)) result.push_back(i);
  return result;
}

// By the eigenvalues of the whole: what is called stable does not grow. Scenes of which some grow as they are chosen
// at first.
TEST(Tolerance, StableRowsLetNothingGrow) {
  int grew = 0, mended = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Cloud cloud = irregular_cloud(2, 14, seed);
    const std::vector<int> fixed = outermost(cloud, 0.9 / 14);
    const Accuracy wanted{0.05, DenseVector::Constant(1, 0.8)};
    ToleranceOptions options{.on_miss = OnDegenerate::Lower, .fixed = fixed};
    const std::vector<int> evolving = others(cloud, fixed);
    const bool grows =
        spectrum(principal_part(assemble_to(wanted, Derivative::Laplacian, cloud, options).matrix(),
                                evolving))
            .grows();
    options.stable = true;
    grew += grows;
    try {
      const Operator op = assemble_to(wanted, Derivative::Laplacian, cloud, options);
      EXPECT_FALSE(spectrum(principal_part(op.matrix(), evolving)).grows()) << seed;
      mended += grows;
    } catch (const SolverError& error) {
      EXPECT_THAT(error.what(), HasSubstr("good enough solutions grow at point"));
    }
  }
  EXPECT_GT(grew, 0);
  EXPECT_EQ(mended, grew);
}

Cloud random_points(int count, int dimension, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, 1);
  Positions x(count, dimension);
  for (double& a : x.reshaped()) a = place(random);
  return Cloud(x);
}

// Random points on a line have neighbours on one side only here and there. Rows of these are exact on linear fields by
// themselves: a half that knows nothing of its wall would be singular.
TEST(Tolerance, StableRowsSeeBothSides) {
  int stable = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Positions x = random_points(60, 1, seed).positions();
    std::ranges::sort(x.reshaped());
    const std::vector<int> fixed = {0, 1, 2, 57, 58, 59};
    try {
      const Operator op =
          assemble_to({0.1, DenseVector::Ones(1)}, Derivative::Laplacian, Cloud(x),
                      {.on_miss = OnDegenerate::Lower, .stable = true, .fixed = fixed});
      // -(pi / length)^2 of the line between the walls.
      EXPECT_LT(spectrum(principal_part(op.matrix(), others(Cloud(x), fixed))).rightmost(), -4)
          << seed;
      ++stable;
    } catch (const SolverError&) {
    }
  }
  EXPECT_GT(stable, 30);
}

TEST(Tolerance, StableRowsAreReachedByFixedPoints) {
  const Cloud near = irregular_cloud(2, 9);
  Positions x(2 * near.size(), 2);
  x << near.positions(), near.positions().rowwise() + Eigen::RowVector2d(40, 0);
  const std::string said = message_of<SolverError>([&] {
    assemble_to({0.5, DenseVector::Ones(1)}, Derivative::Laplacian, Cloud(x),
                {.on_miss = OnDegenerate::Lower, .stable = true, .fixed = outermost(near, 0.1)});
  });
  EXPECT_THAT(said, HasSubstr("no fixed value reaches 81 points, the first at point 81 (at (40."));
}

/// Some rows by a candidate, and how good they are.
struct Tried {
  Operator op;
  DenseVector errors;
};

Tried tried(const RowCandidate& candidate, const Accuracy& wanted, const Cloud& cloud,
            const std::vector<int>& rows) {
  const Neighbours near =
      find_neighbours(cloud, beyond_last * kth_nearest_distances(cloud, candidate.neighbours));
  const Operator op =
      assemble(candidate.scheme, cloud, near, {.on_degenerate = OnDegenerate::Zero, .rows = rows});
  return {op, certified_errors(candidate.scheme.derivative, cloud, op, wanted.wavelengths)};
}

/// The entries of the first candidate that is good enough, of all rows.
Eigen::Index least_entries(const Accuracy& wanted, const Cloud& cloud) {
  std::vector<int> left(cloud.size());
  std::iota(left.begin(), left.end(), 0);
  Eigen::Index entries = 0;
  for (const RowCandidate& candidate : row_candidates(Derivative::Laplacian, 2, false)) {
    const auto [op, errors] = tried(candidate, wanted, cloud, left);
    std::vector<int> still;
    for (int k = 0; k < std::ssize(left); ++k)
      if (errors[k] > wanted.tolerance)
        still.push_back(left[k]);
      else
        entries += op.matrix().row(k).nonZeros();
    left = std::move(still);
    if (left.empty()) return entries;
  }
  ADD_FAILURE() << left.size() << " rows are not good enough";
  return entries;
}

// Where there are many points most rows first try what some others ended with. Half of the square asks for more.
TEST(Tolerance, ManyRowsTakeFewMoreEntriesThanTheLeast) {
  const Cloud cloud = irregular_cloud(2, 60);
  Accuracy wanted{0.05, DenseVector::Constant(cloud.size(), 48 * cloud.spacing())};
  for (int i = 0; i < cloud.size(); ++i)
    if (cloud.positions()(i, 0) > 0.5) wanted.wavelengths[i] /= 2;
  const Operator op = assemble_to(wanted, Derivative::Laplacian, cloud);
  EXPECT_LE(op.rows.errors.maxCoeff(), wanted.tolerance);
  EXPECT_LE(certified_errors(Derivative::Laplacian, cloud, op, wanted.wavelengths).maxCoeff(),
            wanted.tolerance);
  const Eigen::Index least =
      least_entries(wanted, Cloud(cloud.positions(), {.volumes = op.volumes}));
  EXPECT_GE(op.matrix().nonZeros(), 0.99 * static_cast<double>(least));
  EXPECT_LE(op.matrix().nonZeros(), 1.2 * static_cast<double>(least));
}

// Of rows that miss the tolerance there is no better one among the candidates.
TEST(Tolerance, MissedRowsAreTheBestThereAre) {
  int missed = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Cloud cloud = random_points(30, 2, seed);
    const Accuracy wanted{0.02, DenseVector::Constant(1, 2)};
    const Operator op =
        assemble_to(wanted, Derivative::Laplacian, cloud, {.on_miss = OnDegenerate::Lower});
    std::vector<int> rows;
    for (int i = 0; i < cloud.size(); ++i)
      if (op.rows.errors[i] > wanted.tolerance) rows.push_back(i);
    missed += static_cast<int>(rows.size());
    const Cloud same(cloud.positions(), {.volumes = op.volumes});
    for (const RowCandidate& candidate : row_candidates(Derivative::Laplacian, 2, false)) {
      if (1.4 * candidate.neighbours > cloud.size()) continue;  // the last supports have all points
      const DenseVector errors = tried(candidate, wanted, same, rows).errors;
      for (std::size_t k = 0; k < rows.size(); ++k)
        EXPECT_LE(op.rows.errors[rows[k]], errors[static_cast<Eigen::Index>(k)] * (1 + 1e-6))
            << seed << " row " << rows[k] << ' ' << name(candidate.scheme) << ' '
            << candidate.neighbours;
    }
  }
  EXPECT_GT(missed, 20);
}

TEST(Certificate, IsANumberForWavesOfAnyLength) {
  const Cloud cloud = irregular_cloud(2, 10);
  const Operator op = assemble("laplacian-ls-2", cloud, find_neighbours(cloud, 0.35));
  for (const double L : {1e-100, 1e-3, 1e3, 1e100}) {
    const DenseVector errors =
        certified_errors(Derivative::Laplacian, cloud, op, DenseVector::Constant(1, L));
    const double unit = std::pow(2 * std::numbers::pi / L, 2);
    for (int i = 0; i < cloud.size();
         ++i)  // no wave makes more of the entries, or of the derivative
      EXPECT_LE(errors[i], 1.0001 * (op.matrix().row(i).cwiseAbs().sum() / unit + 1)) << L;
  }
}

TEST(Tolerance, BadRequestsAreNamed) {
  const Cloud cloud = irregular_cloud(2, 8);
  const auto message = [&](const Accuracy& wanted, Derivative derivative,
                           ToleranceOptions options) {
    try {
      assemble_to(wanted, derivative, cloud, options);
    } catch (const InvalidInput& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  const DenseVector one = DenseVector::Ones(1), some = DenseVector::Ones(3);
  EXPECT_THAT(message({0, one}, Derivative::Laplacian, {}), HasSubstr("tolerance must be > 0"));
  EXPECT_THAT(message({NAN, one}, Derivative::Laplacian, {}), HasSubstr("not nan"));
  EXPECT_THAT(message({1, some}, Derivative::Laplacian, {}),
              HasSubstr("3 wavelengths for 64 points"));
  EXPECT_THAT(message({1, 0 * one}, Derivative::Laplacian, {}),
              HasSubstr("wavelengths must be > 0"));
  EXPECT_THAT(message({1, 1e-200 * one}, Derivative::Laplacian, {}), HasSubstr("not 1e-200"));
  EXPECT_THAT(message({1, one}, Derivative::Value, {}),
              HasSubstr("rows of a value are not chosen"));
  EXPECT_THAT(message({1, one}, Derivative::Laplacian, {.on_miss = OnDegenerate::Widen}),
              HasSubstr("not widened"));
  EXPECT_THAT(message({1, one}, Derivative::Gradient, {.stable = true}),
              HasSubstr("are about Laplacians, not a gradient"));
  for (const std::vector<int>& fixed : {std::vector{64}, std::vector{3, 3}, std::vector{-1}})
    EXPECT_THAT(message({1, one}, Derivative::Laplacian, {.fixed = fixed}),
                HasSubstr("must ascend from 0 to 63, not be " + std::to_string(fixed.back())));
}

TEST(Tolerance, FewPoints) {
  const Accuracy any{1, DenseVector::Ones(1)};
  EXPECT_EQ(assemble_to(any, Derivative::Laplacian, Cloud(Positions(0, 2))).matrix().rows(), 0);
  EXPECT_THROW(assemble_to(any, Derivative::Laplacian, Cloud(Positions::Zero(1, 2))), StencilError);
  const Cloud three = irregular_cloud(1, 3);
  EXPECT_EQ(assemble_to({10, DenseVector::Ones(1)}, Derivative::Gradient, three).matrix().rows(),
            3);
}

}  // namespace
}  // namespace gradpsi
