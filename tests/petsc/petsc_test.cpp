// The same matrices and solutions whatever the number of processes. To be run by mpirun -n R, for several R;
// every process computes what one machine would, and compares.

#include <gradpsi/petsc.hpp>
#include <limits>
#include <numeric>

#include "base/median.hpp"
#include "clouds.hpp"

namespace gradpsi::petsc {
namespace {

using testing::HasSubstr;
constexpr double infinity = std::numeric_limits<double>::infinity();

int rank() {
  int r;
  MPI_Comm_rank(PETSC_COMM_WORLD, &r);
  return r;
}
int processes() {
  int count;
  MPI_Comm_size(PETSC_COMM_WORLD, &count);
  return count;
}

/// Where points start.
enum class Start { Blocks, AllOnTheLast, NoneOnTheFirst };

/// The numbers of the points that this process gives.
std::vector<int> given_points(int n, Start start) {
  const int all = processes(), last = all - 1;
  int begin = 0, end = 0;
  switch (start) {
    case Start::Blocks:
      begin = n * rank() / all;
      end = n * (rank() + 1) / all;
      break;
    case Start::AllOnTheLast:
      if (rank() == last) end = n;
      break;
    case Start::NoneOnTheFirst:
      if (last == 0) end = n;
      if (rank() > 0) begin = n * (rank() - 1) / last, end = n * rank() / last;
      break;
  }
  std::vector<int> points(end - begin);
  std::iota(points.begin(), points.end(), begin);
  return points;
}

Cloud part_of(const Cloud& whole, const std::vector<int>& points) {
  CloudOptions options{.box = whole.box()};
  if (whole.has_volumes()) options.volumes = whole.volumes()(points);
  return Cloud(whole.positions()(points, Eigen::all), options);
}

Partition partitioned(const Cloud& whole, Start start = Start::Blocks) {
  return Partition(PETSC_COMM_WORLD, part_of(whole, given_points(whole.size(), start)));
}

/// The numbers of own points.
std::vector<int> own_numbers(const Partition& partition) {
  std::vector<int> numbers;
  for (int k = 0; k < partition.cloud().size(); ++k)
    numbers.push_back(static_cast<int>(partition.cloud().number(k)));
  return numbers;
}

/// The numbers of all processes' own points, by rank.
std::vector<int> all_numbers(const Partition& partition) {
  const std::vector<int> own = own_numbers(partition);
  int count = static_cast<int>(own.size());
  std::vector<int> counts(processes()), offsets(processes()), all(partition.size());
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, PETSC_COMM_WORLD);
  std::exclusive_scan(counts.begin(), counts.end(), offsets.begin(), 0);
  MPI_Allgatherv(own.data(), count, MPI_INT, all.data(), counts.data(), offsets.data(), MPI_INT,
                 PETSC_COMM_WORLD);
  return all;
}

Eigen::VectorXd supports_of(const Partition& partition, const Eigen::VectorXd& supports) {
  return supports.size() == 1 ? supports : Eigen::VectorXd(supports(own_numbers(partition)));
}

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
                             "laplacian-positive"}) {
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

/// A diffusion problem on the unit square or cube: fixed on the left, a wall on the right.
struct Problem {
  std::string name, scheme;
  int dimension;
  double time_step, theta;
  bool fixed, walls, prescribed;
  Method method = Method::Auto;
  int side = 0;  // points; 0: enough
};

void PrintTo(const Problem& problem, std::ostream* out) { *out << problem.name; }

class EveryProblem : public testing::TestWithParam<Problem> {};

TEST_P(EveryProblem, IsSolvedAsOnOneMachine) {
  const Problem& p = GetParam();
  const Cloud cloud = irregular_cloud(p.dimension, p.side > 0 ? p.side : p.dimension == 2 ? 24 : 9);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(cloud));
  const Eigen::VectorXd x = cloud.positions().col(0), source = (3 * x).array().sin(),
                        kappa = 1 + 0.5 * x.array();
  const double dx = cloud.spacing();
  const auto conditions = [&](const Cloud& points, const std::vector<int>& places,
                              const auto& gradient) {
    BoundaryConditions result;
    for (const int i : places) {
      const double at = points.positions()(i, 0);
      if (p.fixed && at < dx) result.fixed.points.push_back(i);
      if (p.walls && at > 1 - dx) result.walls.points.push_back(i);
    }
    const auto count = [](const auto& list) { return static_cast<Eigen::Index>(list.size()); };
    if (p.prescribed)
      result.fixed.values = Eigen::VectorXd::Constant(count(result.fixed.points), 0.25);
    if (!p.walls) return result;
    auto& walls = result.walls;
    walls.normals = Positions::Zero(count(walls.points), p.dimension);
    walls.normals.col(0).setOnes();
    walls.gradient = gradient(walls.points).axes;
    walls.flux = Eigen::VectorXd::Constant(count(walls.points), 0.7);
    walls.transfer = Eigen::VectorXd::Constant(count(walls.points), 0.3);
    return result;
  };
  DiffusionOptions options{.diffusivity = 0.6,
                           .time_step = p.time_step,
                           .theta = p.theta,
                           .source = source,
                           .solver = {.tolerance = 1e-13}};

  const Neighbours all_near = gradpsi::find_neighbours(cloud, support);
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  gradpsi::ImplicitDiffusion alone(
      cloud, gradpsi::with_conductivity(gradpsi::assemble(p.scheme, cloud, all_near), kappa),
      conditions(cloud, all,
                 [&](const auto& rows) {
                   return gradpsi::assemble("gradient-direct-soc", cloud, all_near, {.rows = rows});
                 }),
      options);

  const Partition partition = partitioned(cloud);
  const std::vector<int> own = own_numbers(partition);
  const Subdomain mine(partition, support);
  const Neighbours near = find_neighbours(mine, support);
  options.source = source(own);
  options.solver.method = p.method;
  ImplicitDiffusion heat(mine, with_conductivity(assemble(p.scheme, mine, near), mine, kappa(own)),
                         conditions(mine.cloud(), mine.own(),
                                    [&](const auto& rows) {
                                      return assemble("gradient-direct-soc", mine, near,
                                                      {.rows = rows});
                                    }),
                         options);
  Eigen::VectorXd u = (4 * x).array().cos(), together = u(own);
  for (int n = 0; n < 3; ++n) {
    alone.step(u);
    EXPECT_LE(heat.step(together).residual, 1e-11);  // 1e-12, or rounding
  }
  // Residuals up to 1e-12, condition numbers below 1e5.
  EXPECT_LT((together - u(own)).norm(), 1e-8 * u.norm()) << heat.solver().description;
  EXPECT_EQ(heat.solver().description.find("BoomerAMG") != std::string::npos, p.side > 0);
}

INSTANTIATE_TEST_SUITE_P(
    Petsc, EveryProblem,
    testing::Values(
        Problem{"symmetric", "laplacian-mixed-zoc", 2, 1e-3, 1, true, false, false},
        Problem{"symmetric_crank", "laplacian-mixed-zoc", 2, 1e-3, 0.5, true, false, false},
        Problem{"without_conditions", "laplacian-mixed-zoc", 2, 1e-2, 1, false, false, false},
        Problem{"long_steps", "laplacian-mixed-zoc", 2, 10, 1, true, false, true},
        Problem{"steady", "laplacian-mixed-zoc", 3, infinity, 1, true, false, false},
        Problem{"corrected", "laplacian-mixed-soc", 2, 2e-4, 0.5, true, false, true},
        Problem{"corrected_long", "laplacian-mixed-soc", 2, 1, 1, true, false, false},
        Problem{"walls", "laplacian-mixed-soc", 2, 1e-3, 0.5, true, true, false},
        Problem{"walls_steady", "laplacian-mixed-soc", 3, infinity, 1, true, true, true},
        Problem{"walls_zoc", "laplacian-mixed-zoc", 2, 0.1, 1, false, true, false},
        Problem{"indefinite", "laplacian-direct-zoc", 2, 1e-2, 1, true, false, false},
        Problem{"cholesky", "laplacian-mixed-zoc", 2, 1, 1, true, false, false, Method::Cholesky},
        Problem{"lu", "laplacian-mixed-soc", 3, 1, 1, true, true, false, Method::Lu},
        Problem{"multigrid", "laplacian-mixed-zoc", 2, infinity, 1, true, false, false,
                Method::Auto, 60},
        Problem{"multigrid_walls", "laplacian-mixed-zoc", 2, 1, 1, true, true, false, Method::Auto,
                60}),
    [](const auto& the_case) { return the_case.param.name; });

TEST(Petsc, WallsCostFewIterations) {
  const Cloud cloud = irregular_cloud(2, 30);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(cloud));
  const Partition partition = partitioned(cloud);
  const Subdomain mine(partition, support);
  const Neighbours near = find_neighbours(mine, support);
  BoundaryConditions conditions;
  std::vector<int> right;
  for (const int i : mine.own()) {
    const double x = mine.cloud().positions()(i, 0);
    if (x < cloud.spacing()) conditions.fixed.points.push_back(i);
    if (x > 1 - cloud.spacing()) right.push_back(i);
  }
  const auto iterations = [&] {
    ImplicitDiffusion heat(mine, assemble("laplacian-mixed-zoc", mine, near), conditions,
                           {.time_step = infinity, .solver = {.method = Method::Krylov}});
    Eigen::VectorXd u = partition.cloud().positions().col(1);
    return heat.step(u).iterations;
  };
  const int without = iterations();
  conditions.walls = {.points = right, .normals = Positions::Ones(std::ssize(right), 2)};
  conditions.walls.gradient = assemble("gradient-direct-soc", mine, near, {.rows = right}).axes;
  EXPECT_LT(iterations(), 2 * without + 10);
}

TEST(Petsc, AFewPointsAreEnough) {
  for (const int n : {0, 1, 2, 3, 5}) {
    Positions x(n, 2);
    for (int i = 0; i < n; ++i) x.row(i) << 0.1 * i, 0.01 * i * i;
    const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(n, 0.01)});
    const Partition partition = partitioned(cloud);
    const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.25);
    const Subdomain mine(partition, support);
    if (n == 1) {
      // Alone, it has no neighbour.
      const Neighbours near = find_neighbours(mine, support);
      EXPECT_THROW(assemble("laplacian-mixed-zoc", mine, near), StencilError);
      continue;
    }
    const Neighbours near = find_neighbours(mine, support);
    ImplicitDiffusion heat(mine, assemble("laplacian-mixed-zoc", mine, near), {},
                           {.time_step = 0.1});
    Eigen::VectorXd u = partition.cloud().positions().col(0);
    heat.step(u);
    if (n == 0) continue;
    gradpsi::ImplicitDiffusion alone(
        cloud,
        gradpsi::assemble("laplacian-mixed-zoc", cloud, gradpsi::find_neighbours(cloud, support)),
        {}, {.time_step = 0.1});
    Eigen::VectorXd all = x.col(0);
    alone.step(all);
    EXPECT_LT((u - all(own_numbers(partition))).norm(), 1e-12);
  }
}

TEST(Petsc, MedianIsThatOfAll) {
  for (const int n : {1, 2, 3, 10, 101}) {
    Eigen::VectorXd all(n);
    for (int i = 0; i < n; ++i) all[i] = i % 7 == 3 ? infinity : std::sin(3 * i) * (i % 5);
    const Eigen::VectorXd here = all(given_points(n, Start::NoneOnTheFirst));
    EXPECT_EQ(median(PETSC_COMM_WORLD, here), gradpsi::median(all)) << n;
  }
}

TEST(Petsc, SpacingOfAnEvenNumberNeedsBothMiddlePoints) {
  const Cloud cloud(Positions{{0.0}, {1.0}, {3.5}, {6.5}});
  EXPECT_EQ(cloud.spacing(), 1.75);
  EXPECT_EQ(spacing(partitioned(cloud)), 1.75);
}

TEST(Petsc, PointsFarOutsideTheirBoxCoincideWithTheirImages) {
  const Cloud cloud(Positions{{0.1}, {0.4}, {0.7}, {1000.1}}, {.box = {1, 0, 0}});
  const Partition partition = partitioned(cloud);
  std::vector<std::int64_t> found;
  for (const int k : coincident_points(partition)) found.push_back(partition.cloud().number(k));
  const auto own = own_numbers(partition);
  const bool owns_it = std::ranges::binary_search(own, 3);
  EXPECT_EQ(found, owns_it ? std::vector<std::int64_t>{3} : std::vector<std::int64_t>());
}

TEST(Petsc, AClosePairIsWarnedOfWhoeverOwnsIt) {
  const Cloud lattice = make_cloud({.dimension = 2, .points_per_side = 8});
  for (int i = 0; i < 64; i += 5) {
    Positions x(65, 2);
    x << lattice.positions(), lattice.positions().row(i).array() + 1e-9;
    const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.3);
    const Partition partition = partitioned(Cloud(x));
    const Subdomain mine(partition, support);
    const Neighbours near = find_neighbours(mine, support);
    for (const std::string& warning : warnings(mine.cloud(), near))
      EXPECT_THAT(warning,
                  testing::AnyOf(HasSubstr("points " + std::to_string(i) + " and 64 are"),
                                 HasSubstr("points 64 and " + std::to_string(i) + " are")));
  }
}

TEST(Petsc, HalosMustReachAsFarAsSupports) {
  const Partition partition = partitioned(irregular_cloud(2, 8));
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.4);
  const Subdomain mine(partition, support);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(mine, 2 * support); }),
              HasSubstr("less than the 0.8 that its support may need"));
  const Neighbours near = find_neighbours(mine, support);
  EXPECT_THAT(message_of<InvalidInput>([&] {
                assemble("laplacian-mixed-soc", mine, near, {.on_degenerate = OnDegenerate::Widen});
              }),
              HasSubstr("that widened rows may need"));
}

TEST(Petsc, ValuesAreThoseOfOwnPoints) {
  const Partition partition = partitioned(irregular_cloud(2, 8));
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.4);
  const Subdomain mine(partition, support);
  const auto here = static_cast<Eigen::Index>(partition.cloud().size());
  const Eigen::VectorXd few = Eigen::VectorXd::Ones(rank() == 0 ? here - 1 : here);
  EXPECT_THROW(mine.spread(few), InvalidInput);
  EXPECT_THROW(partition.to_owners(Eigen::VectorXd::Ones(1000)), InvalidInput);
  EXPECT_THROW(partition.to_givers(few), InvalidInput);
  const Operator laplacian = assemble("laplacian-mixed-zoc", mine, find_neighbours(mine, support));
  DiffusionOptions options{.time_step = 1};
  if (rank() == 0) options.source = few;
  EXPECT_THROW(ImplicitDiffusion(mine, laplacian, {}, options), InvalidInput);
  options.source = rank() == 0 ? Eigen::VectorXd::Ones(here) : Eigen::VectorXd();
  if (processes() > 1) {
    EXPECT_THROW(ImplicitDiffusion(mine, laplacian, {}, options), InvalidInput);
  }
  for (const SolverOptions& bad :
       {SolverOptions{.tolerance = 0}, {.max_iterations = 0}, {.memory = -1}})
    EXPECT_THROW(ImplicitDiffusion(mine, laplacian, {}, {.time_step = 1, .solver = bad}),
                 InvalidInput);
}

TEST(Petsc, CoincidentPointsAreFoundWhoeverOwnsThem) {
  const Cloud lattice = make_cloud({.dimension = 2, .points_per_side = 8});
  Positions x(80, 2);
  x << lattice.positions(), lattice.positions()(Eigen::seqN(3, 16, 3), Eigen::all);
  const Cloud cloud(x);
  const Partition partition = partitioned(cloud);
  std::vector<int> found;
  for (const int k : coincident_points(partition))
    found.push_back(static_cast<int>(partition.cloud().number(k)));
  std::vector<int> expected;
  for (const int i : own_numbers(partition))
    if (i >= 64) expected.push_back(i);
  EXPECT_EQ(found, expected);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.3);
  const Subdomain mine(partition, support);
  EXPECT_THAT(message_of<InvalidInput>([&] { find_neighbours(mine, support); }),
              HasSubstr("coincide at ("));
}

TEST(Petsc, AnErrorAnywhereIsAnErrorEverywhere) {
  const std::string message = message_of<InvalidInput>([] {
    together(PETSC_COMM_WORLD, [] {
      if (rank() == processes() - 1) throw InvalidInput("no");
    });
  });
  const int last = processes() - 1;
  EXPECT_EQ(message, last == 0 ? "no"
                               : "no (on rank " + std::to_string(last) + " of " +
                                     std::to_string(processes()) + ")");
  EXPECT_EQ(message_of<SolverError>(
                [] { together(PETSC_COMM_WORLD, [] { throw SolverError("nor this"); }); }),
            "nor this");
  EXPECT_THROW(together(PETSC_COMM_WORLD, [] { throw std::bad_alloc(); }), std::bad_alloc);
  try {
    together(PETSC_COMM_WORLD, [] { throw StencilError("row", 3, 2, 0.5); });
  } catch (const StencilError& error) {
    EXPECT_EQ(error.point, 3);
    EXPECT_EQ(error.neighbours, 2);
    EXPECT_EQ(error.reciprocal_condition, 0.5);
  }
}

TEST(Petsc, ErrorsNameThePointOfTheWholeCloud) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(cloud));
  const Partition partition = partitioned(cloud);
  const Subdomain mine(partition, support);
  const Neighbours near = find_neighbours(mine, support);
  const Operator laplacian = assemble("laplacian-mixed-zoc", mine, near);
  ImplicitDiffusion heat(mine, laplacian, {}, {.time_step = 1});
  const std::vector<int> own = own_numbers(partition);
  Eigen::VectorXd u = Eigen::VectorXd::Ones(std::ssize(own));
  for (std::size_t k = 0; k < own.size(); ++k)
    if (own[k] == 77) u[k] = infinity;
  EXPECT_THAT(message_of<InvalidInput>([&] { heat.step(u); }), HasSubstr("not finite at point 77"));

  EXPECT_THAT(message_of<SolverError>(
                  [&] { ImplicitDiffusion(mine, laplacian, {}, {.time_step = infinity}); }),
              HasSubstr("the 144 rows connected with that of point 0 sum to zero"));
  EXPECT_THROW(ImplicitDiffusion(mine, laplacian, {}, {.time_step = -1}), InvalidInput);
  if (processes() == 1) return;
  const Cloud disagreeing(Positions::Zero(1, rank() == 0 ? 1 : 2));
  EXPECT_THROW(Partition(PETSC_COMM_WORLD, disagreeing), InvalidInput);
}

TEST(Petsc, TwoIslandsAreToldApart) {
  // Steady, one island held at a point, the other not: its constants are in the null space.
  const Cloud lattice = make_cloud({.dimension = 2, .points_per_side = 10});
  Positions x(200, 2);
  x << lattice.positions(), lattice.positions().rowwise() + Eigen::RowVector2d(5, 0);
  const Cloud cloud(x, {.volumes = Eigen::VectorXd::Constant(200, 0.01)});
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 0.25);
  const Partition partition = partitioned(cloud);
  const Subdomain mine(partition, support);
  const Operator laplacian = assemble("laplacian-mixed-zoc", mine, find_neighbours(mine, support));
  BoundaryConditions held;
  for (const int i : mine.own())
    if (mine.cloud().number(i) == 17) held.fixed.points.push_back(i);
  EXPECT_THAT(message_of<SolverError>(
                  [&] { ImplicitDiffusion(mine, laplacian, held, {.time_step = infinity}); }),
              HasSubstr("the 100 rows connected with that of point 100 sum to zero"));
}

}  // namespace
}  // namespace gradpsi::petsc

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
  const int result = RUN_ALL_TESTS();
  PetscFinalize();
  return result;
}
