#include <cmath>

#include "petsc/processes.hpp"

namespace gradpsi::petsc {
namespace {

/// A scene's cloud and supports.
struct Scene {
  Cloud cloud;
  Eigen::VectorXd supports;
  AssemblyOptions options = {.on_degenerate = OnDegenerate::Zero};
};

Scene scene(const std::string& name, int dimension) {
  const Cloud cloud = irregular_cloud(dimension, dimension == 1 ? 90 : dimension == 2 ? 20 : 9);
  const Eigen::VectorXd one = Eigen::VectorXd::Constant(1, rich_support(cloud));
  if (name == "uneven") return {cloud, uneven_supports(cloud)};
  if (name == "periodic") return {periodic(cloud), one};
  if (name == "number_density") return {Cloud(cloud.positions()), one};
  if (name == "widened") return {cloud, 0.5 * one, {.on_degenerate = OnDegenerate::Widen}};
  if (name == "outside_its_box") {  // points that stand for their images
    Positions x = cloud.positions();
    for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i).array() += static_cast<double>(i % 3 - 1);
    CloudOptions options{.volumes = cloud.volumes()};
    std::fill_n(options.box.begin(), dimension, 1.0);
    return {Cloud(x, options), one};
  }
  return {cloud, one};
}

using SceneAndDimension = std::tuple<std::string, int, Start>;

class EveryScene : public testing::TestWithParam<SceneAndDimension> {
 protected:
  Scene scene() const { return petsc::scene(std::get<0>(GetParam()), std::get<1>(GetParam())); }
  Start start() const { return std::get<2>(GetParam()); }
};

TEST_P(EveryScene, HasTheMatricesOfOneMachineToTheBit) {
  const auto [cloud, supports, options] = scene();
  const Neighbours all_near = gradpsi::find_neighbours(cloud, supports);
  const Partition partition = partitioned(cloud, start());
  const Eigen::VectorXd own_supports = supports_of(partition, supports);
  const Subdomain mine(partition, widest * own_supports);
  const Neighbours near = find_neighbours(mine, own_supports);
  const std::vector<int> numbers = all_numbers(partition);
  for (const char* scheme : {"gradient-direct-soc", "laplacian-mixed-zoc", "laplacian-mixed-soc-ls",
                             "laplacian-positive", "laplacian-kgf"}) {
    if (options.on_degenerate == OnDegenerate::Widen && reach(scheme) > 1) {
      EXPECT_THROW(assemble(scheme, mine, near, options), InvalidInput);
      continue;
    }
    const Operator whole = gradpsi::assemble(scheme, cloud, all_near, options);
    const Operator op = assemble(scheme, mine, near, options);
    const auto G = matrices(mine, op);
    ASSERT_EQ(G.size(), whole.axes.size());
    for (std::size_t axis = 0; axis < G.size(); ++axis) {
      PetscInt rows, columns, first, end;
      MatGetSize(G[axis].get(), &rows, &columns);
      MatGetOwnershipRange(G[axis].get(), &first, &end);
      EXPECT_EQ(rows, cloud.size());
      EXPECT_EQ(columns, cloud.size());
      EXPECT_EQ(first, partition.first());
      for (PetscInt row = first; row < end; ++row) {
        PetscInt count;
        const PetscInt* column;
        const double* value;
        MatGetRow(G[axis].get(), row, &count, &column, &value);
        const auto expected = whole.axes[axis].row(numbers[row]);
        EXPECT_EQ(count, expected.nonZeros());
        for (PetscInt e = 0; e < count; ++e)
          EXPECT_EQ(value[e], whole.axes[axis].coeff(numbers[row], numbers[column[e]]))
              << scheme << ", point " << numbers[row];
        MatRestoreRow(G[axis].get(), row, &count, &column, &value);
      }
      MatInfo info;
      MatGetInfo(G[axis].get(), MAT_GLOBAL_SUM, &info);
      EXPECT_EQ(info.nz_used, static_cast<double>(whole.axes[axis].nonZeros()));
      EXPECT_EQ(info.mallocs, 0);
    }
  }
}

TEST_P(EveryScene, HasTheSpacingOfOneMachineToTheBit) {
  const Cloud cloud = scene().cloud;
  EXPECT_EQ(spacing(partitioned(cloud, start())), cloud.spacing());
}

TEST_P(EveryScene, BringsPointsToTheirOwnersAndBack) {
  const Cloud cloud = scene().cloud;
  const std::vector<int> given = given_points(cloud.size(), start());
  const Partition partition = partitioned(cloud, start());
  EXPECT_EQ(partition.size(), cloud.size());
  std::vector<int> numbers = all_numbers(partition);
  const std::vector<int> own = own_numbers(partition);
  EXPECT_TRUE(std::ranges::is_sorted(own));
  EXPECT_EQ(numbers[partition.first()], own.front());
  std::ranges::sort(numbers);
  for (int i = 0; i < cloud.size(); ++i) ASSERT_EQ(numbers[i], i);
  EXPECT_EQ(partition.cloud().positions(), Positions(cloud.positions()(own, Eigen::all)));
  const Eigen::MatrixXd values = Eigen::MatrixXd::NullaryExpr(
      cloud.size(), 2,
      [](Eigen::Index i, Eigen::Index j) { return static_cast<double>(2 * i + j); });
  const Eigen::MatrixXd here = partition.to_owners(values(given, Eigen::all));
  EXPECT_EQ(here, Eigen::MatrixXd(values(own, Eigen::all)));
  EXPECT_EQ(partition.to_givers(here), Eigen::MatrixXd(values(given, Eigen::all)));
  // Balance: as many points as any other process, give or take one.
  EXPECT_LE(std::abs(static_cast<double>(own.size()) - 1.0 * cloud.size() / processes()), 1);
}

TEST_P(EveryScene, HasAHaloOfAllWithinReach) {
  const auto [cloud, supports, options] = scene();
  const Neighbours all_near = gradpsi::find_neighbours(cloud, supports);
  const Partition partition = partitioned(cloud, start());
  const Eigen::VectorXd own_supports = supports_of(partition, supports);
  const Subdomain mine(partition, own_supports);
  const Neighbours near = find_neighbours(mine, own_supports);
  const std::vector<int> own = own_numbers(partition);
  for (std::size_t k = 0; k < own.size(); ++k) {
    std::vector<int> numbers;
    for (const int j : near.of(mine.own()[k]))
      numbers.push_back(static_cast<int>(mine.cloud().number(j)));
    EXPECT_TRUE(std::ranges::equal(numbers, all_near.of(own[k])));
  }
  const Eigen::VectorXd x = cloud.positions().col(0);
  const Eigen::VectorXd spread = mine.spread(x(own));
  for (int i = 0; i < mine.cloud().size(); ++i) EXPECT_EQ(spread[i], x[mine.cloud().number(i)]);
}

std::string scene_name(const testing::TestParamInfo<SceneAndDimension>& info) {
  const auto& [name, dimension, start] = info.param;
  return name + "_" + std::to_string(dimension) + "d_start_" +
         std::to_string(static_cast<int>(start));
}

INSTANTIATE_TEST_SUITE_P(Petsc, EveryScene,
                         testing::Combine(testing::Values("open", "uneven", "periodic",
                                                          "number_density", "widened",
                                                          "outside_its_box"),
                                          testing::Values(1, 2, 3), testing::Values(Start::Blocks)),
                         scene_name);

INSTANTIATE_TEST_SUITE_P(
    PetscStart, EveryScene,
    testing::Combine(testing::Values("open", "number_density"), testing::Values(2),
                     testing::Values(Start::AllOnTheLast, Start::NoneOnTheFirst)),
    scene_name);

}  // namespace
}  // namespace gradpsi::petsc
