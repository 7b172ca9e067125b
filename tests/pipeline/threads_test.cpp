// Every function that takes `threads` starts no more than those.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "clouds.hpp"
#include "gradpsi/gradpsi.hpp"

namespace gradpsi {
namespace {

/// What the functions are called with: enough points that each has work for several threads.
struct Scene {
  Cloud cloud = make_cloud({.dimension = 2, .points_per_side = 100, .jitter = 0.2});
  Cloud bare{cloud.positions()};  // without volumes
  Neighbours near = find_neighbours(cloud, 2.5 / 100, 1);
  Operator laplacian = assemble("laplacian-mixed-zoc", cloud, near, {.threads = 1});
  Operator gradient = assemble("gradient-direct-zoc", cloud, near, {.threads = 1});
  Operator hessian =
      assemble("hessian-mls-2", cloud, near, {.on_degenerate = OnDegenerate::Zero, .threads = 1});
  Eigen::VectorXd u = cloud.positions().rowwise().sum();
};

struct Call {
  const char* name;
  std::function<void(Scene&, int threads)> run;
};

void PrintTo(const Call& call, std::ostream* out) { *out << call.name; }

SolverOptions krylov(int threads) {
  return {.method = Method::Krylov, .tolerance = 1e-3, .threads = threads};
}

/// I - c Psi
SparseMatrix implicit(const Scene& s) {
  SparseMatrix one(s.cloud.size(), s.cloud.size());
  one.setIdentity();
  return one - 1e-5 * s.laplacian.matrix();
}

const Call calls[] = {
    {"spacing", [](Scene& s, int threads) { s.bare.spacing(threads); }},
    {"reorder", [](Scene& s, int threads) { reorder(s.cloud, threads); }},
    {"find_neighbours", [](Scene& s, int threads) { find_neighbours(s.cloud, 0.02, threads); }},
    {"find_neighbours_of_rows",
     [](Scene& s, int threads) {
       find_neighbours(s.cloud, Eigen::VectorXd::Constant(1, 0.02), {1, 2, 9'999}, threads);
     }},
    {"find_neighbours_with_a_skin",
     [](Scene& s, int threads) { find_neighbours(s.cloud, 0.02, Skin{0.01}, threads); }},
    {"is_stale",
     [](Scene&, int threads) {
       static const Cloud line = make_cloud({.dimension = 1, .points_per_side = 100'000});
       static const Neighbours skinned = find_neighbours(line, 2e-5, Skin{1e-6}, 1);
       is_stale(skinned, line, threads);
     }},
    {"find_neighbours_of_the_lonely",  // which tells the usual distance
     [](Scene& s, int threads) { find_neighbours(s.cloud, 1e-6, threads); }},
    {"nearest_distances", [](Scene& s, int threads) { nearest_distances(s.cloud, threads); }},
    {"kth_nearest_distances",
     [](Scene& s, int threads) { kth_nearest_distances(s.cloud, 5, threads); }},
    {"local_spacing", [](Scene& s, int threads) { local_spacing(s.bare, threads); }},
    {"with_walls",
     [](Scene& s, int threads) {
       FluxWalls walls{.points = {}, .normals = Positions::Ones(3000, 2)};
       for (int i = 0; i < 3000; ++i) walls.points.push_back(i);
       with_walls(s.laplacian, s.cloud, s.near, walls, threads);
     }},
    {"warnings", [](Scene& s, int threads) { warnings(s.cloud, s.near, threads); }},
    {"number_density_volumes",
     [](Scene& s, int threads) {
       number_density_volumes(s.cloud, s.near, kernels().front(), threads);
     }},
    {"assemble",
     [](Scene& s, int threads) {
       for (const auto policy : {OnDegenerate::Zero, OnDegenerate::Lower, OnDegenerate::Widen})
         assemble("laplacian-mixed-soc", s.cloud, s.near,
                  {.on_degenerate = policy, .threads = threads});
     }},
    {"assemble_without_volumes",
     [](Scene& s, int threads) {
       assemble("gradient-direct-zoc", s.bare, s.near, {.threads = threads});
     }},
    {"assemble_positive",
     [](Scene& s, int threads) {
       assemble("laplacian-positive", s.cloud, s.near,
                {.on_degenerate = OnDegenerate::Widen, .threads = threads});
     }},
    {"reassemble",
     [](Scene& s, int threads) {
       reassemble("laplacian-mixed-zoc", s.cloud, s.near, s.laplacian, {.threads = threads});
     }},
    {"with_symmetric_supports",
     [](Scene& s, int threads) {
       with_symmetric_supports("laplacian-mixed-zoc", s.laplacian, threads);
     }},
    {"interpolate",
     [](Scene& s, int threads) {
       interpolate("value-mls-1", s.cloud, s.cloud.positions(), DenseVector(),
                   {.threads = threads});
     }},
    {"multiply",
     [](Scene& s, int threads) {
       Eigen::VectorXd y;
       multiply(s.laplacian.matrix(), s.u, y, threads);
     }},
    {"multiply_columns",
     [](Scene& s, int threads) {
       Eigen::MatrixXd Y;
       multiply(s.laplacian.matrix(), Eigen::MatrixXd(s.u.replicate(1, 3)), Y, threads);
     }},
    {"multiply_axes",
     [](Scene& s, int threads) {
       Eigen::MatrixXd Y;
       multiply(s.gradient.axes, s.u, Y, threads);
     }},
    {"multiply_single",
     [](Scene& s, int threads) {
       Eigen::VectorXd y;
       multiply(SingleSparseMatrix(s.laplacian.matrix().cast<float>()), s.u, y, threads);
     }},
    {"multiply_symmetric",
     [](Scene& s, int threads) {
       const SparseMatrix upper = s.laplacian.matrix().triangularView<Eigen::Upper>();
       Eigen::VectorXd y;
       multiply_symmetric(upper, s.u, y, threads);
     }},
    {"multiply_vectors",
     [](Scene& s, int threads) {
       Eigen::MatrixXd Y;
       multiply(VectorOperator::VelocityGradient, s.gradient.axes,
                Eigen::MatrixXd(s.u.replicate(1, 2)), Y, threads);
     }},
    {"block_matrix",
     [](Scene& s, int threads) { block_matrix(VectorOperator::Curl, s.gradient.axes, threads); }},
    {"conservative_companion",
     [](Scene& s, int threads) { conservative_companion(s.gradient, threads); }},
    {"viscous_force",
     [](Scene& s, int threads) {
       viscous_force(s.hessian, s.gradient, Eigen::VectorXd::Ones(s.cloud.size()), threads);
     }},
    {"diagnose",
     [](Scene& s, int threads) { diagnose("laplacian-mixed-zoc", s.cloud, s.laplacian, threads); }},
    {"spectrum",
     [](Scene& s, int threads) {
       try {  // few of the restarts are needed to see it
         spectrum(implicit(s), {}, 0, threads);
       } catch (const SolverError&) {
       }
     }},
    {"LinearSolver",
     [](Scene& s, int threads) {
       Eigen::VectorXd x(s.u.size());
       LinearSolver(implicit(s), krylov(threads)).solve(s.u, x);
     }},
    {"ImplicitDiffusion",
     [](Scene& s, int threads) {
       ImplicitDiffusion heat(s.cloud, s.laplacian, {},
                              {.time_step = 1e-6, .solver = krylov(threads)});
       Eigen::MatrixXd u = s.u;
       heat.step(u);
     }},
};

class Threads : public testing::TestWithParam<Call> {};

/// Those of this process. OpenMP keeps what it has started for the next parallel region.
int running() {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                                        std::filesystem::directory_iterator()));
}

/// How many threads a call adds to the one there is. In a process of its own.
int started(const Call& call, int threads) {
  Scene scene;
  omp_set_num_threads(4);
  const int before = running();
  try {
    call.run(scene, threads);
  } catch (const InvalidInput&) {
  }
  return running() - before;
}

TEST_P(Threads, AreAsManyAsAskedFor) {
  if (!std::filesystem::exists("/proc/self/task")) GTEST_SKIP() << "threads cannot be counted";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::exit(started(GetParam(), 1)), testing::ExitedWithCode(0), "");
  // It is one that starts threads, and they are seen.
  EXPECT_EXIT(std::exit(started(GetParam(), 0) > 0), testing::ExitedWithCode(1), "");
}

TEST_P(Threads, OutOfRangeAreRefused) {
  static Scene scene;
  EXPECT_THROW(GetParam().run(scene, -1), InvalidInput);
  EXPECT_THROW(GetParam().run(scene, 1025), InvalidInput);
}

#if GRADPSI_WITH_CHOLMOD
/// OpenBLAS, whose threads factorisations are given, keeps those that it has started as well.
TEST(Fault42, FactorisationsByOneThreadStartNone) {
  if (!std::filesystem::exists("/proc/self/task")) GTEST_SKIP() << "threads cannot be counted";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  setenv("OPENBLAS_NUM_THREADS", "1", 1);  // it would have some before main()
  for (const Method method : {Method::Cholesky, Method::Lu}) {
    const Call call{"factorise", [method](Scene& s, int threads) {
                      Eigen::VectorXd x(s.u.size());
                      LinearSolver(implicit(s), {.method = method, .threads = threads},
                                   {.cloud = s.cloud})
                          .solve(s.u, x);
                    }};
    EXPECT_EXIT(std::exit(started(call, 1)), testing::ExitedWithCode(0), "") << name(method);
    if (!dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) continue;
    EXPECT_EXIT(std::exit(started(call, 4) > 0), testing::ExitedWithCode(1), "") << name(method);
  }
}
#endif

INSTANTIATE_TEST_SUITE_P(AllFunctions, Threads, testing::ValuesIn(calls),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace gradpsi
