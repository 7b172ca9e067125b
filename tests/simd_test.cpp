// The vector code, for every kind of processor that this machine can stand for, against plain loops.

#include <random>

#include "clouds.hpp"
#include "matrix/products.hpp"
#include "operators/assemble.hpp"
#include "operators/batch/batch.hpp"
#include "search/candidates.hpp"

namespace gradpsi {
namespace {

class VectorCode : public testing::TestWithParam<Cpu> {
 protected:
  const Cpu& code() const { return GetParam(); }
};

/// Largest difference over the largest entry, row by row, times the reciprocal condition number.
double difference(const Operator& op, const Operator& reference) {
  double worst = 0;
  for (std::size_t a = 0; a < op.axes.size(); ++a)
    for (int k = 0; k < op.axes[a].rows(); ++k) {
      const Eigen::RowVectorXd row = op.axes[a].row(k), expected = reference.axes[a].row(k);
      worst = std::max(worst, (row - expected).lpNorm<Eigen::Infinity>() /
                                  expected.lpNorm<Eigen::Infinity>() *
                                  reference.rows.reciprocal_condition[k]);
    }
  return worst;
}

/// Rounding: sums of up to 100 terms, and a small system.
constexpr double tolerance = 32 * 2.2e-16;

TEST_P(VectorCode, AssemblesWhatRowsByThemselvesGive) {
  for (const int d : {1, 2, 3})
    for (const bool in_a_box : {false, true}) {
      const Cloud open = irregular_cloud(d, d == 1 ? 53 : d == 2 ? 13 : 7);
      const Cloud cloud = in_a_box ? periodic(open) : open;
      const Neighbours near = find_neighbours(cloud, uneven_supports(cloud));
      for (const Kernel& kernel : kernels())
        for (const Scheme& scheme : compact_schemes()) {
          const AssemblyOptions options{.kernel = kernel};
          const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
          const Operator op = assemble_with(&code(), {scheme}, cloud, near, options).front();
          EXPECT_LT(difference(op, rows), tolerance) << name(scheme) << d << kernel.name;
          EXPECT_LT(((op.rows.reciprocal_condition - rows.rows.reciprocal_condition).array() /
                     rows.rows.reciprocal_condition.array())
                            .abs()
                            .maxCoeff() *
                        rows.rows.reciprocal_condition.minCoeff(),
                    tolerance);
          EXPECT_EQ(op.rows.degree, rows.rows.degree);
          EXPECT_EQ(op.rows.neighbours, rows.rows.neighbours);
        }
    }
}

TEST_P(VectorCode, AssemblesHigherDegreesAsRowsByThemselves) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = periodic(irregular_cloud(d, d == 1 ? 40 : d == 2 ? 14 : 10));
    for (int P = 3; P <= highest_batched_degree(d); ++P)
      for (const char* derivative : {"gradient-ls-", "laplacian-ls-"}) {
        const Scheme scheme(derivative + std::to_string(P));
        const double support = std::min(1.1 * *support_ratio(scheme) * cloud.spacing(), 0.49);
        const Neighbours near = find_neighbours(cloud, support);
        const AssemblyOptions options{.on_degenerate = OnDegenerate::Zero};
        const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
        const Operator op = assemble_with(&code(), {scheme}, cloud, near, options).front();
        EXPECT_EQ(op.rows.outcome, rows.rows.outcome);
        // Both are refined until the conditions hold to rounding, which fixes the weights up to that
        // times the condition after scaling the diagonal; 100 times that is allowed.
        EXPECT_LT(difference(op, rows), 100 * tolerance) << name(scheme) << d;
        for (std::size_t a = 0; a < op.axes.size(); ++a)
          EXPECT_LT(SparseMatrix(op.axes[a] - rows.axes[a]).norm(), 1e-9 * rows.axes[a].norm());
      }
  }
}

TEST_P(VectorCode, LeavesDegenerateRowsToTheirPolicy) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 1.5 * cloud.spacing());
  for (const Scheme& scheme : compact_schemes())
    for (const auto policy : {OnDegenerate::Lower, OnDegenerate::Widen, OnDegenerate::Zero}) {
      const AssemblyOptions options{.on_degenerate = policy};
      const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
      const Operator op = assemble_with(&code(), {scheme}, cloud, near, options).front();
      EXPECT_EQ(op.rows.outcome, rows.rows.outcome) << name(scheme);
      EXPECT_EQ(op.rows.degree, rows.rows.degree);
      EXPECT_EQ(op.matrix().nonZeros(), rows.matrix().nonZeros());
    }
}

TEST_P(VectorCode, FindsCandidates) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform;
  for (const int d : {1, 2, 3})
    for (int count = 0; count < 40; ++count) {
      std::array<std::vector<double>, 3> x, kept;
      std::array<const double*, 3> from{};
      std::array<double*, 3> to{};
      std::vector<int> number(count + 8), kept_number(count + 16);
      for (int a = 0; a < d; ++a) {
        x[a].assign(count + 8, std::numeric_limits<double>::infinity());
        for (int k = 0; k < count; ++k) x[a][k] = uniform(generator);
        kept[a].resize(count + 16);
        from[a] = x[a].data();
        to[a] = kept[a].data();
      }
      for (int k = 0; k < count; ++k) number[k] = 100 + 7 * k;
      const std::array<double, 3> low = {0.1, 0.2, 0}, high = {0.8, 0.9, 0.9}, shift = {0, 1, -1};
      std::vector<int> inside;
      for (int k = 0; k < count; ++k) {
        bool all = true;
        for (int a = 0; a < d; ++a) all = all && x[a][k] >= low[a] && x[a][k] <= high[a];
        if (all) inside.push_back(k);
      }
      const int found = candidate_kernels(code()).filter[d - 1](
          from.data(), number.data(), 0, count, low.data(), high.data(), shift.data(), to.data(),
          kept_number.data());
      ASSERT_EQ(found, std::ssize(inside));
      for (int k = 0; k < found; ++k) {
        EXPECT_EQ(kept_number[k], number[inside[k]]);
        for (int a = 0; a < d; ++a) EXPECT_EQ(kept[a][k], x[a][inside[k]] + shift[a]);
      }
      if (count == 0) continue;
      // The neighbours of one of the points.
      const int centre = count / 2;
      std::array<double, 3> at{};
      for (int a = 0; a < d; ++a) at[a] = x[a][centre];
      std::vector<int> near;
      double nearest = std::numeric_limits<double>::infinity();
      for (int k = 0; k < count; ++k) {
        double squared = 0;
        for (int a = 0; a < d; ++a) squared += (x[a][k] - at[a]) * (x[a][k] - at[a]);
        if (k != centre) nearest = std::min(nearest, squared);
        if (k != centre && squared < 0.16) near.push_back(number[k]);
      }
      int coincident = 0;
      const int size = candidate_kernels(code()).select[d - 1](
          from.data(), number.data(), count, at.data(), 0.16, kept_number.data(), &coincident);
      kept_number.resize(size);
      EXPECT_EQ(kept_number, near);
      EXPECT_EQ(coincident, 1);  // the point itself
      const double least = candidate_kernels(code()).nearest[d - 1](
          from.data(), number.data(), count, at.data(), number[centre]);
      EXPECT_EQ(least == nearest || std::abs(least - nearest) < 1e-15 * nearest, true);
    }
}

TEST_P(VectorCode, MultipliesRowsOfAnyLength) {
  constexpr int n = 40;
  const Eigen::MatrixXd dense = Eigen::MatrixXd::Random(n, n);
  SparseMatrix A(n, n);  // row i has i entries
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) A.insert(i, (7 * j) % n) = dense(i, (7 * j) % n);
  A.makeCompressed();
  const SparseMatrix B = 2 * A, C = A.cwiseProduct(A);
  const Eigen::SparseMatrix<float, Eigen::RowMajor> single = A.cast<float>();
  const auto entries = static_cast<int>(A.nonZeros());
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(n, 4);
  Eigen::MatrixXd y(n, 4);
  const auto near = [&](const Eigen::MatrixXd& result, const Eigen::MatrixXd& expected) {
    return (result - expected).cwiseAbs().maxCoeff() < 1e-13;
  };
  for (int vectors = 1; vectors <= 4; ++vectors) {
    ProductArguments<double> arguments{
        A.outerIndexPtr(), A.innerIndexPtr(), entries, {A.valuePtr()}, {}, {}};
    for (int v = 0; v < vectors; ++v)
      arguments.x[v] = x.col(v).data(), arguments.y[v] = y.col(v).data();
    product_kernels(code()).vectors[vectors - 1](arguments, 0, n);
    EXPECT_TRUE(near(y.leftCols(vectors), A * x.leftCols(vectors)));
  }
  for (int matrices = 1; matrices <= 3; ++matrices) {
    product_kernels(code()).matrices[matrices - 1](
        {A.outerIndexPtr(),
         A.innerIndexPtr(),
         entries,
         {A.valuePtr(), B.valuePtr(), C.valuePtr()},
         {x.data()},
         {y.col(0).data(), y.col(1).data(), y.col(2).data()}},
        0, n);
    const SparseMatrix* all[] = {&A, &B, &C};
    for (int m = 0; m < matrices; ++m) EXPECT_TRUE(near(y.col(m), *all[m] * x.col(0)));
  }
  product_kernels(code()).single({single.outerIndexPtr(),
                                  single.innerIndexPtr(),
                                  entries,
                                  {single.valuePtr()},
                                  {x.data()},
                                  {y.data()}},
                                 0, n);
  EXPECT_TRUE(near(y.col(0), single.cast<double>() * x.col(0)));
}

INSTANTIATE_TEST_SUITE_P(Processors, VectorCode,
                         testing::ValuesIn(std::vector<Cpu>(runnable_cpus().begin(),
                                                            runnable_cpus().end())),
                         [](const auto& the_case) { return std::string(the_case.param.name); });

}  // namespace
}  // namespace gradpsi
