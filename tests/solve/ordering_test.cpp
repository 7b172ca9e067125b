#include "solve/ordering.hpp"

#include "solve/systems.hpp"

namespace gradpsi {
namespace {

TEST(Dissection, IsAPermutationWithLittleFill) {
  for (const int dimension : {1, 2, 3}) {
    const System system("laplacian-mixed-zoc", dimension, dimension == 3 ? 12 : 40);
    Eigen::VectorXi order = dissection(system.cloud.positions(), system.matrix);
    std::sort(order.begin(), order.end());
    for (int k = 0; k < order.size(); ++k) ASSERT_EQ(order[k], k);
    const auto entries = [&](Ordering ordering) {
      return LinearSolver(system.matrix, {.ordering = ordering}, system.points)
          .report()
          .factor.entries;
    };
    EXPECT_LT(entries(Ordering::Coordinates), 1.4 * entries(Ordering::Amd)) << dimension;
  }
}

}  // namespace
}  // namespace gradpsi
