// Steps allocate nothing once the first has been done. This program counts all allocations, those of
// the solver libraries included, by standing between them and the C library.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <gradpsi/gradpsi.hpp>

namespace {
std::atomic<long> allocations = 0;
}

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  ++allocations;
  *memory = __libc_memalign(alignment, size);
  return 0;
}
}

namespace gradpsi {
namespace {

class Steps : public testing::TestWithParam<std::tuple<const char*, Method, double>> {};

TEST_P(Steps, AllocateNothingAfterTheFirst) {
  const auto [scheme, method, time_step] = GetParam();
  const Cloud cloud = make_cloud(Lattice{.points_per_side = 40, .jitter = 0.2});
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  BoundaryConditions conditions;
  WallConditions& walls = conditions.walls;
  for (int i = 0; i < cloud.size(); ++i) {
    if (cloud.positions()(i, 0) < 0.05) conditions.fixed.points.push_back(i);
    if (cloud.positions()(i, 0) > 0.975) walls.points.push_back(i);
  }
  if (std::string(scheme).ends_with("soc")) {
    walls.normals = Eigen::RowVector2d(1, 0).replicate(walls.points.size(), 1);
    walls.gradient = assemble("gradient-direct-soc", cloud, near, {.rows = walls.points}).axes;
  } else {
    walls.points.clear();
  }
  ImplicitDiffusion heat(cloud, assemble(scheme, cloud, near), conditions,
                         {.time_step = time_step,
                          .theta = 0.5,
                          .solver = {.method = method, .tolerance = 1e-10, .threads = 1}});
  // OpenBLAS's products of small matrices allocate on their own account; one column needs none.
  Eigen::MatrixXd u = Eigen::MatrixXd::Random(cloud.size(), method == Method::Cholesky ? 1 : 2);
  heat.step(u);
  const long before = allocations;
  for (int n = 0; n < 3; ++n) heat.step(u);
  EXPECT_EQ(allocations - before, 0);
}

INSTANTIATE_TEST_SUITE_P(Diffusion, Steps,
                         testing::Values(std::tuple("laplacian-mixed-zoc", Method::Cholesky, 1e-3),
                                         std::tuple("laplacian-mixed-soc", Method::Lu, 1e-3),
                                         std::tuple("laplacian-mixed-zoc", Method::Krylov, 1e-3),
                                         std::tuple("laplacian-mixed-soc", Method::Krylov, 1e-3),
                                         std::tuple("laplacian-mixed-soc", Method::Krylov, 1.0)),
                         [](const auto& the_case) {
                           std::string scheme = std::get<0>(the_case.param);
                           std::replace(scheme.begin(), scheme.end(), '-', '_');
                           return scheme + "_" + std::string(name(std::get<1>(the_case.param))) +
                                  (std::get<2>(the_case.param) == 1 ? "_stiff" : "");
                         });

TEST(VectorProducts, AllocateNothingOnceTheResultHasItsSize) {
  const Cloud cloud = make_cloud(Lattice{.points_per_side = 60, .jitter = 0.2});
  const Operator gradient =
      assemble("gradient-direct-foc", cloud, find_neighbours(cloud, 3 * cloud.spacing()));
  const Eigen::MatrixXd v = Eigen::MatrixXd::Ones(cloud.size(), 2);
  Eigen::MatrixXd strain;
  multiply(VectorOperator::Strain, gradient.axes, v, strain, 1);
  const long before = allocations;
  multiply(VectorOperator::Strain, gradient.axes, v, strain, 1);
  EXPECT_EQ(allocations, before);
}

// What threads work with grows with the longest row, not with the cloud.
TEST(MovingPoints, AllocateNoMoreForMorePoints) {
  std::vector<long> counts;
  for (const int side : {30, 90}) {
    Cloud cloud = make_cloud(Lattice{.points_per_side = side, .jitter = 0.2});
    const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing(), Skin{0.1 / side}, 1);
    const std::vector<Scheme> schemes = {"gradient-ls-2", "laplacian-mixed-soc-ls"};
    std::vector<Operator> operators = assemble(schemes, cloud, near, {.threads = 1});
    const Positions places = cloud.positions().array() + 1e-3 / side;
    const long before = allocations;
    EXPECT_FALSE(is_stale(near, cloud, 1));
    cloud.move_to(places);
    reassemble(schemes, cloud, near, operators, {.threads = 1});
    counts.push_back(allocations - before);
  }
  EXPECT_EQ(counts[0], counts[1]);
}

}  // namespace
}  // namespace gradpsi
