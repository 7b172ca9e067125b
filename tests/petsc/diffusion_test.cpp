#include <numeric>

#include "petsc/processes.hpp"

namespace gradpsi::petsc {
namespace {

using testing::HasSubstr;

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
    const bool damped = p.theta == 0.5 && n == 0;
    damped ? alone.damped_step(u) : alone.step(u);
    // 1e-12, or rounding
    EXPECT_LE((damped ? heat.damped_step(together) : heat.step(together)).residual, 1e-11);
  }
  // Residuals up to 1e-12, condition numbers below 1e5.
  EXPECT_LT((together - u(own)).norm(), 1e-8 * u.norm()) << heat.solver().description;
  EXPECT_EQ(heat.solver().description.find("levels of points") != std::string::npos, p.side > 0);
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

struct MultigridProblem {
  std::string scheme;
  int dimension;
  bool walls;
};

void PrintTo(const MultigridProblem& problem, std::ostream* out) {
  *out << problem.scheme << problem.dimension << problem.walls;
}

class MultigridOfProcesses : public testing::TestWithParam<MultigridProblem> {};

TEST_P(MultigridOfProcesses, TakesTheIterationsOfOneMachine) {
  const MultigridProblem& p = GetParam();
  const Cloud cloud = irregular_cloud(p.dimension, p.dimension == 2 ? 50 : 14);
  const double dx = cloud.spacing();
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(cloud));
  const auto conditions = [&](const Cloud& points, const std::vector<int>& places,
                              const auto& gradient) {
    BoundaryConditions result;
    for (const int i : places) {
      const auto x = points.positions().row(i);
      if (p.walls && x[0] > 1 - dx)
        result.walls.points.push_back(i);
      else if (x.minCoeff() < dx || x.maxCoeff() > 1 - dx)
        result.fixed.points.push_back(i);
    }
    if (!p.walls) return result;
    result.walls.normals = Positions::Zero(std::ssize(result.walls.points), p.dimension);
    result.walls.normals.col(0).setOnes();
    result.walls.gradient = gradient(result.walls.points).axes;
    return result;
  };
  const DiffusionOptions options{.time_step = infinity, .solver = {.method = Method::Multigrid}};
  const Eigen::VectorXd field = (40 * cloud.positions().col(0)).array().sin();

  const Neighbours all_near = gradpsi::find_neighbours(cloud, support);
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  gradpsi::ImplicitDiffusion alone(
      cloud, gradpsi::assemble(p.scheme, cloud, all_near),
      conditions(cloud, all,
                 [&](const auto& rows) {
                   return gradpsi::assemble("gradient-direct-soc", cloud, all_near, {.rows = rows});
                 }),
      options);
  Eigen::VectorXd u = field;
  const int expected = alone.step(u).iterations;

  const Partition partition = partitioned(cloud);
  const Subdomain mine(partition, support);
  const Neighbours near = find_neighbours(mine, support);
  ImplicitDiffusion heat(mine, assemble(p.scheme, mine, near),
                         conditions(mine.cloud(), mine.own(),
                                    [&](const auto& rows) {
                                      return assemble("gradient-direct-soc", mine, near,
                                                      {.rows = rows});
                                    }),
                         options);
  Eigen::VectorXd own = field(own_numbers(partition));
  // Conjugate gradients are the same; of BiCGSTAB, ours and PETSc's differ in what they start from.
  const bool symmetric = p.scheme == "laplacian-mixed-zoc" && !p.walls;
  EXPECT_NEAR(heat.step(own).iterations, expected, symmetric ? 1 : 1 + expected / 2);
  EXPECT_THAT(heat.solver().description, HasSubstr("multigrid on "));
}

INSTANTIATE_TEST_SUITE_P(Petsc, MultigridOfProcesses,
                         testing::Values(MultigridProblem{"laplacian-mixed-zoc", 2, false},
                                         MultigridProblem{"laplacian-mixed-zoc", 3, false},
                                         MultigridProblem{"laplacian-mixed-zoc", 2, true},
                                         MultigridProblem{"laplacian-mixed-soc", 2, false},
                                         MultigridProblem{"laplacian-ls-2", 3, true}));

TEST(Petsc, WeakRowsAreCorrectedByThemselvesOrByBoomerAmg) {
  const Cloud cloud = irregular_cloud(2, 60);
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, rich_support(cloud));
  const Partition partition = partitioned(cloud);
  const Subdomain mine(partition, support);
  const Operator laplacian = assemble("laplacian-mixed-soc", mine, find_neighbours(mine, support));
  ImplicitDiffusion heat(mine, laplacian, {},
                         {.time_step = 1, .solver = {.method = Method::Multigrid}});
  // Along the edge, where neighbours are on one side.
  EXPECT_THAT(heat.solver().description, HasSubstr("rows of weak diagonals corrected"));
  Eigen::VectorXd u = partition.cloud().positions().col(1);
  EXPECT_LT(heat.step(u).iterations, 30);

  Operator changed = laplacian;
  for (std::size_t k = 0; k < mine.own().size(); ++k)
    if (mine.cloud().number(mine.own()[k]) % 3 == 0)
      changed.axes[0].coeffRef(static_cast<int>(k), mine.own()[k]) *= 0.1;
  EXPECT_THAT(ImplicitDiffusion(mine, std::move(changed), {},
                                {.time_step = 1, .solver = {.method = Method::Multigrid}})
                  .solver()
                  .description,
              HasSubstr("BoomerAMG"));
}

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
