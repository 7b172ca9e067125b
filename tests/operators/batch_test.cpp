// Rows W at a time, for every kind of processor that this machine can stand for, against rows by themselves.

#include "operators/batch/batch.hpp"

#include "clouds.hpp"
#include "operators/assemble.hpp"

namespace gradpsi {
namespace {

/// The same by each kind of processor.
std::vector<Operator> by_each(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                              const AssemblyOptions& options) {
  std::vector<Operator> result;
  for (const Cpu& cpu : runnable_cpus())
    result.push_back(std::move(assemble_with(&cpu, {scheme}, cloud, near, options).front()));
  return result;
}

/// Of row k.
Eigen::Map<const Eigen::VectorXd> entries(const SparseMatrix& matrix, int k) {
  const int begin = matrix.outerIndexPtr()[k];
  return {matrix.valuePtr() + begin, matrix.outerIndexPtr()[k + 1] - begin};
}

/// Largest difference over the largest entry, row by row, times the reciprocal condition number.
double difference(const Operator& op, const Operator& reference) {
  double worst = 0;
  for (std::size_t a = 0; a < op.axes.size(); ++a)
    for (int k = 0; k < op.axes[a].rows(); ++k) {
      const auto row = entries(op.axes[a], k), expected = entries(reference.axes[a], k);
      if (row.size() != expected.size()) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, (row - expected).lpNorm<Eigen::Infinity>() /
                                  expected.lpNorm<Eigen::Infinity>() *
                                  reference.rows.reciprocal_condition[k]);
    }
  return worst;
}

/// Rounding: sums of up to 100 terms, and a small system.
constexpr double tolerance = 32 * 2.2e-16;

TEST(VectorCode, AssemblesWhatRowsByThemselvesGive) {
  for (const int d : {1, 2, 3})
    for (const bool in_a_box : {false, true}) {
      const Cloud open = irregular_cloud(d, d == 1 ? 53 : d == 2 ? 13 : 7);
      const Cloud cloud = in_a_box ? periodic(open) : open;
      const Neighbours near = find_neighbours(cloud, uneven_supports(cloud));
      for (const Kernel& kernel : kernels().first(d == 1 ? kernels().size() : d == 2 ? 2 : 1))
        for (const Scheme& scheme : compact_schemes()) {
          const AssemblyOptions options{.kernel = kernel};
          const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
          for (const Operator& op : by_each(scheme, cloud, near, options)) {
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
}

TEST(VectorCode, AssemblesHigherDegreesAsRowsByThemselves) {
  for (const int d : {1, 2, 3}) {
    const Cloud cloud = periodic(irregular_cloud(d, d == 1 ? 40 : d == 2 ? 14 : 10));
    for (int P = 3; P <= highest_batched_degree(d); ++P)
      for (const char* derivative :
           {"gradient-ls-", "laplacian-ls-", "gradient-mls-", "hessian-mls-", "value-mls-"}) {
        const Scheme scheme(derivative + std::to_string(P));
        const double support = std::min(1.1 * *support_ratio(scheme) * cloud.spacing(), 0.49);
        const Neighbours near = find_neighbours(cloud, support);
        const AssemblyOptions options{.on_degenerate = OnDegenerate::Zero};
        const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
        for (const Operator& op : by_each(scheme, cloud, near, options)) {
          EXPECT_EQ(op.rows.outcome, rows.rows.outcome);
          // Both are refined until the conditions hold to rounding, which fixes the weights up to that
          // times the condition after scaling the diagonal; 100 times that is allowed.
          EXPECT_LT(difference(op, rows), 100 * tolerance) << name(scheme) << d;
          for (std::size_t a = 0; a < op.axes.size(); ++a)
            EXPECT_LT(SparseMatrix(op.axes[a] - rows.axes[a]).norm(), 1e-9 * rows.axes[a].norm());
        }
      }
  }
}

TEST(VectorCode, LeavesDegenerateRowsToTheirPolicy) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 1.5 * cloud.spacing());
  for (const Scheme& scheme : compact_schemes())
    for (const auto policy : {OnDegenerate::Lower, OnDegenerate::Widen, OnDegenerate::Zero}) {
      const AssemblyOptions options{.on_degenerate = policy};
      const Operator rows = assemble_with(nullptr, {scheme}, cloud, near, options).front();
      for (const Operator& op : by_each(scheme, cloud, near, options)) {
        EXPECT_EQ(op.rows.outcome, rows.rows.outcome) << name(scheme);
        EXPECT_EQ(op.rows.degree, rows.rows.degree);
        EXPECT_EQ(op.matrix().nonZeros(), rows.matrix().nonZeros());
      }
    }
}

}  // namespace
}  // namespace gradpsi
