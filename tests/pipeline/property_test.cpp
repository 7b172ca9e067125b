// Laws that hold for any points, scheme, kernel and support, tried on random ones. A failure prints the
// seed of its case and what was drawn with it; with_seed() alone then repeats it.

#include <cmath>

#include "pipeline/laws.hpp"

namespace gradpsi {
namespace {

void neighbours_are_within_the_support(const RandomCase& c, const Neighbours& near) {
  for (int i = 0; i < c.size(); ++i) {
    const double h = near.support(i);
    std::vector<char> listed(c.size());
    for (const int j : near.of(i)) listed[j] = true;
    for (int j = 0; j < c.size(); ++j) {
      const double q = c.displacement(i, j, h).norm();
      if (std::abs(q - 1) > 4 * eps) {
        ASSERT_EQ(static_cast<bool>(listed[j]), j != i && q < 1) << i << " " << j;
      }
    }
  }
}

void threads_do_not_matter(const RandomCase& c, const Operator& op, const Neighbours& near) {
  SCOPED_TRACE(__func__);
  RandomCase other = c;
  for (const int threads : {1, 3}) {
    other.options.threads = threads;
    const Neighbours again = find_neighbours(c.cloud, c.supports, threads);
    EXPECT_EQ(again.offsets, near.offsets);
    EXPECT_EQ(again.indices, near.indices);
    expect_identical(op, assemble(c.scheme, c.cloud, again, other.options));
  }
}

void a_subset_of_rows_equals_rows_of_the_whole(const RandomCase& c, const Operator& op,
                                               const Neighbours& near, Random& random) {
  AssemblyOptions options = c.options;
  options.rows.emplace(7);
  for (int& row : *options.rows) row = random.below(c.size());
  const Operator part = assemble(c.scheme, c.cloud, near, options);
  for (int k = 0; k < 7; ++k) {
    const int i = (*options.rows)[k];
    EXPECT_EQ(part.rows.outcome[k], op.rows.outcome[i]);
    EXPECT_EQ(part.rows.degree[k], op.rows.degree[i]);
    EXPECT_EQ(part.rows.supports[k], op.rows.supports[i]);
    EXPECT_EQ(part.rows.neighbours[k], op.rows.neighbours[i]);
    EXPECT_EQ(part.rows.reciprocal_condition[k], op.rows.reciprocal_condition[i]);
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
      EXPECT_EQ(Eigen::RowVectorXd(part.axes[axis].row(k)),
                Eigen::RowVectorXd(op.axes[axis].row(i)));
  }
}

Scheme another(const RandomCase& c, Random& random) {
  for (;;)
    if (const Scheme scheme = schemes()[random.below(static_cast<int>(schemes().size()))];
        scheme.derivative == c.scheme.derivative && degree(scheme) <= 3 &&
        scheme.consistency != Consistency::Positive && scheme.consistency != Consistency::Kgf)
      return scheme;
}

void reassembling_equals_assembling(const RandomCase& c, const Operator& op, const Neighbours& near,
                                    Random& random) {
  SCOPED_TRACE(__func__);
  if (c.positive() || c.scheme.consistency == Consistency::Kgf ||
      c.options.on_degenerate == OnDegenerate::Widen)
    return;
  Operator again = assemble(another(c, random), c.cloud, near, c.options);
  reassemble(c.scheme, c.cloud, near, again, c.options);
  expect_identical(op, again);
}

void several_in_one_pass_equal_one_by_one(const RandomCase& c, const Operator& op,
                                          const Neighbours& near, Random& random) {
  SCOPED_TRACE(__func__);
  const Scheme other = another(c, random);
  std::vector<Scheme> together = {other, c.scheme};
  for (const Derivative derivative :
       {Derivative::Gradient, Derivative::Laplacian, Derivative::Hessian}) {
    Scheme twin = c.scheme;  // of another derivative, which shares its system if there is one
    twin.derivative = derivative;
    if (twin != c.scheme && std::ranges::find(schemes(), twin) != schemes().end())
      together.insert(together.begin(), twin);
  }
  const auto all = assemble(together, c.cloud, near, c.options);
  expect_same(c, op, dense(op), all.back(), dense(all.back()), 1);
  EXPECT_EQ(op.rows.outcome, all.back().rows.outcome);
}

void check(const RandomCase& c, Random& random) {
  const Neighbours near = find_neighbours(c.cloud, c.supports);
  const Operator op = assemble(c.scheme, c.cloud, near, c.options);
  rows_obey_their_laws(c, op, random);
  a_subset_of_rows_equals_rows_of_the_whole(c, op, near, random);
  reassembling_equals_assembling(c, op, near, random);
  if (c.size() > 1000) return threads_do_not_matter(c, op, near);
  neighbours_are_within_the_support(c, near);
  other_views_agree(c, op, random);
  several_in_one_pass_equal_one_by_one(c, op, near, random);
}

class Properties : public testing::TestWithParam<int> {};

TEST_P(Properties, HoldForAnyPointsSchemeKernelAndSupport) {
  const int d = GetParam(), cases = d == 3 ? 60 : 150;
  for (int k = 0; k < cases; ++k) {
    const std::uint64_t seed = 100'000 * d + k;
    const RandomCase c = with_seed(seed, d, k % 20 == 19);
    SCOPED_TRACE(c.description);
    Random random(seed + 1'000'000);
    try {
      check(c, random);
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Dimensions, Properties, testing::Values(1, 2, 3),
                         [](const auto& dimension) {
                           return std::to_string(dimension.param) + "d";
                         });

}  // namespace
}  // namespace gradpsi
