// What is made of times, fed to what would measure them.

#include "common/timing.hpp"

#include <gmock/gmock.h>

#include "studies/spmv.hpp"

namespace gradpsi::apps {
namespace {

/// Runs that take these times, over and over.
struct Runs {
  std::vector<double> seconds;
  std::size_t done = 0;
  double operator()() { return seconds[done++ % seconds.size()]; }
};

TEST(Fault43, TimesThatAgreeAreTakenAsTheyAre) {
  Timer timer;
  Runs runs{{9e-3, 1.0e-3, 1.1e-3, 1.05e-3}};  // the first finds all cold
  EXPECT_EQ(timer.settled(std::ref(runs), 0), 1.05e-3);
  EXPECT_EQ(runs.done, 4U);
  Runs one_of_three{{1e-3, 1e-3, 1e-3, 7e-3}};
  EXPECT_EQ(timer.settled(std::ref(one_of_three), 0), 1e-3);
  EXPECT_EQ(one_of_three.done, 4U);
  Runs slow{{0.5, 0.6}};
  EXPECT_DOUBLE_EQ(timer.settled(std::ref(slow), 0.1), 0.55);
  EXPECT_EQ(slow.done, 2U);
  EXPECT_EQ(timer.warning(), "");
}

TEST(Fault43, ShortRunsAreRepeatedForAsLongAsAsked) {
  Timer timer;
  Runs runs{{1.0 / 1024}};
  timer.settled(std::ref(runs), 0.125);
  EXPECT_EQ(runs.done, 1U + 128U);
  Runs very_short{{1e-9}};
  timer.settled(std::ref(very_short), 0.125);
  EXPECT_EQ(very_short.done, 1U + 1000U);
}

TEST(Fault43, TimesThatDisagreeAreRepeated) {
  Timer timer;
  // A disturbance that passes: 4 of 6 are near 1.
  Runs runs{{1e-3, 1e-3, 2e-3, 4e-3, 1e-3, 1.01e-3, 0.99e-3}};
  EXPECT_DOUBLE_EQ(timer.settled(std::ref(runs), 0), 1.005e-3);
  EXPECT_EQ(runs.done, 7U);
  Runs slow{{0.5, 1.5, 0.52}};
  EXPECT_EQ(timer.settled(std::ref(slow), 0.1), 0.52);
  EXPECT_EQ(slow.done, 3U);
  EXPECT_EQ(timer.warning(), "");
}

TEST(Fault43, TimesThatNeverAgreeAreWarnedOf) {
  Timer timer;
  Runs runs{{1e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3, 128e-3, 5e-3}};
  EXPECT_EQ(timer.settled(std::ref(runs), 0), 8e-3);
  EXPECT_EQ(runs.done, 10U);  // three rounds of three
  EXPECT_EQ(timer.warning(),
            "warning: of 1 times 1 differs by more than a quarter from run to run, however often "
            "repeated: the machine is busy, and they may be too long\n");
  Runs slow{{0.3, 0.9, 2.7, 8.1}};
  EXPECT_DOUBLE_EQ(timer.settled(std::ref(slow), 0.1), 1.8);
  EXPECT_EQ(slow.done, 4U);
  Runs steady{{1e-3}};
  timer.settled(std::ref(steady), 0);
  EXPECT_THAT(timer.warning(), testing::StartsWith("warning: of 3 times 2 differ by"));
}

TEST(Fault43, AShareAboveTheWholeIsNone) {
  EXPECT_EQ(spmv::share({"", 1, 5e9, 1e10}), 0.5);
  EXPECT_EQ(spmv::share({"", 1, 1e10, 1e10}), 1);
  EXPECT_TRUE(std::isnan(spmv::share({"", 1, 1.01e10, 1e10})));
}

}  // namespace
}  // namespace gradpsi::apps
