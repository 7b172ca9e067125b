// The search among candidates, for every kind of processor that this machine can stand for.

#include "search/candidates.hpp"

#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

class VectorCandidates : public testing::TestWithParam<Cpu> {
 protected:
  const Cpu& code() const { return GetParam(); }
};

TEST_P(VectorCandidates, RanksAreThoseOfSorting) {
  std::mt19937_64 generator(3);
  for (int count = 0; count < 40; ++count) {
    std::vector<double> values;
    for (int k = 0; k < count; ++k)
      values.push_back(static_cast<double>(generator() % 20));  // some alike
    std::vector<double> sorted = values;
    std::ranges::sort(sorted);
    values.resize(count + 8, std::numeric_limits<double>::infinity());
    const auto ranked = candidate_kernels(code()).ranked;
    for (int rank = 1; rank <= count; ++rank)
      EXPECT_EQ(ranked(values.data(), count, rank), sorted[rank - 1]);
    EXPECT_EQ(ranked(values.data(), count, count + 1), std::numeric_limits<double>::infinity());
  }
}

TEST_P(VectorCandidates, AreThoseOfPlainLoops) {
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

INSTANTIATE_TEST_SUITE_P(Processors, VectorCandidates,
                         testing::ValuesIn(std::vector<Cpu>(runnable_cpus().begin(),
                                                            runnable_cpus().end())),
                         [](const auto& the_case) { return std::string(the_case.param.name); });

}  // namespace
}  // namespace gradpsi
