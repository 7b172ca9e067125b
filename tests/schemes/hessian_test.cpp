// Hessians: what makes them more than six more matrices.

#include "clouds.hpp"

namespace gradpsi {
namespace {

std::vector<Scheme> hessians() {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (scheme.derivative == Derivative::Hessian) chosen.push_back(scheme);
  return chosen;
}

class Hessian : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
  Cloud cloud() const {
    const int d = dimension();
    return make_cloud({.dimension = d,
                       .points_per_side = d == 1   ? 40
                                          : d == 2 ? 15
                                                   : degree(scheme()) + 3,
                       .jitter = 0.2,
                       .seed = 5});
  }
  Neighbours neighbours(const Cloud& cloud) const {
    const double ratio = support_ratio(scheme()).value_or(dimension() == 3 ? 2.9 : 3.2);
    return find_neighbours(cloud, ratio * cloud.spacing());
  }
  /// All rows in one and two dimensions, in three every fifth.
  AssemblyOptions options(const Cloud& cloud) const {
    std::vector<int> rows;
    for (int i = 0; i < cloud.size(); i += dimension() == 3 ? 5 : 1) rows.push_back(i);
    return {.on_degenerate = OnDegenerate::Zero, .rows = rows};
  }
  /// The same scheme of another derivative.
  Scheme other(Derivative derivative) const {
    Scheme result = scheme();
    result.derivative = derivative;
    return result;
  }
};

DenseVector absolute_row_sums(const SparseMatrix& matrix) {
  return matrix.cwiseAbs() * DenseVector::Ones(matrix.cols());
}

// Solved from one system, a row is the same to 64 units in the last place over its reciprocal condition
// number; `sizes` are sums of absolute entries, one a row.
void expect_near(const SparseMatrix& found, const SparseMatrix& expected, const DenseVector& sizes,
                 const RowReport& rows) {
  const DenseVector difference = absolute_row_sums(found - expected);
  for (Eigen::Index k = 0; k < difference.size(); ++k)
    EXPECT_LE(difference[k], 64 * 2.2e-16 / std::max(rows.reciprocal_condition[k], 1e-9) * sizes[k])
        << "row " << k << ", reciprocal condition number " << rows.reciprocal_condition[k];
}

// One system, other right-hand sides: sum_a H_aa is the Laplacian's matrix, near edges too, where rows are
// solved one by one.
TEST_P(Hessian, TraceIsTheLaplacian) {
  const Cloud cloud = this->cloud();
  const Neighbours near = neighbours(cloud);
  const AssemblyOptions options = this->options(cloud);
  const Operator hessian = assemble(scheme(), cloud, near, options);
  const Operator laplacian = assemble(other(Derivative::Laplacian), cloud, near, options);
  const auto names = components(Derivative::Hessian, dimension());
  ASSERT_EQ(hessian.axes.size(), names.size());
  SparseMatrix trace(laplacian.matrix().rows(), cloud.size());
  DenseVector sizes = DenseVector::Zero(trace.rows());
  for (std::size_t o = 0; o < names.size(); ++o) {
    sizes += absolute_row_sums(hessian.axes[o]);
    if (names[o][0] == names[o][1]) trace += hessian.axes[o];
  }
  EXPECT_GT(laplacian.matrix().norm(), 0);
  expect_near(trace, laplacian.matrix(), sizes, laplacian.rows);
  EXPECT_EQ(hessian.rows.outcome, laplacian.rows.outcome);
  EXPECT_EQ(hessian.rows.degree, laplacian.rows.degree);
}

// What is assembled in one pass with a Laplacian, from the same systems, is what it is by itself.
TEST_P(Hessian, IsTheSameBesideALaplacian) {
  const Cloud cloud = this->cloud();
  const Neighbours near = neighbours(cloud);
  const AssemblyOptions options = this->options(cloud);
  const auto together = assemble({other(Derivative::Laplacian), scheme()}, cloud, near, options);
  const Operator alone = assemble(scheme(), cloud, near, options);
  for (std::size_t o = 0; o < alone.axes.size(); ++o)
    expect_near(together[1].axes[o], alone.axes[o], absolute_row_sums(alone.axes[o]), alone.rows);
}

TEST(HessianComponents, AreNamedInTheOrderOfTheMatrices) {
  using testing::ElementsAre;
  EXPECT_THAT(components(Derivative::Hessian, 1), ElementsAre("xx"));
  EXPECT_THAT(components(Derivative::Hessian, 2), ElementsAre("xx", "xy", "yy"));
  EXPECT_THAT(components(Derivative::Hessian, 3), ElementsAre("xx", "xy", "xz", "yy", "yz", "zz"));
  EXPECT_THAT(components(Derivative::Gradient, 3), ElementsAre("x", "y", "z"));
  EXPECT_THAT(components(Derivative::Laplacian, 3), ElementsAre(""));
}

INSTANTIATE_TEST_SUITE_P(Schemes, Hessian,
                         testing::Combine(testing::ValuesIn(hessians()), testing::Values(1, 2, 3)),
                         case_name);

}  // namespace
}  // namespace gradpsi
