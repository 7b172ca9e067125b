// Memory that runs out, at every place where it can: the n-th allocation of a call fails, n = 1, 2, 3 and
// so on until the call meets no more. Each time there is an exception or, where a library has found
// another way, the right result; nothing leaks, arguments and files are what they were, and the next
// call works. This program stands between all allocations and the C library.
//
// Not failed, because these libraries cannot cope: allocations of OpenMP's runtime, which ends the program;
// those of OpenBLAS, which asks again for ever; those of the dynamic linker for new threads.

#include <link.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <new>

#include "clouds.hpp"

namespace {

std::atomic<long> live = 0;       // allocations that have not been freed
std::atomic<long> countdown = 0;  // the allocation that fails; 0: none
std::atomic<bool> from_then_on;   // and all that follow it
std::atomic<bool> has_failed;

struct Library {
  std::uintptr_t begin, end;
};
std::array<Library, 8> spared;
int spared_count = 0;

int spare(dl_phdr_info* info, std::size_t, void*) {
  const std::string_view name = info->dlpi_name;
  bool spares = false;
  for (const char* library : {"libgomp", "libomp", "openblas", "ld-linux"})
    spares |= name.find(library) != name.npos;
  for (int k = 0; spares && k < info->dlpi_phnum; ++k)
    if (const auto& segment = info->dlpi_phdr[k];
        segment.p_type == PT_LOAD && (segment.p_flags & PF_X) != 0)
      spared[spared_count++] = {info->dlpi_addr + segment.p_vaddr,
                                info->dlpi_addr + segment.p_vaddr + segment.p_memsz};
  return 0;
}

bool fails(const void* caller) {
  if (countdown == 0) return false;
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  for (int k = 0; k < spared_count; ++k)
    if (at >= spared[k].begin && at < spared[k].end) return false;
  if (const long before = countdown--; before > 1) return false;
  countdown = from_then_on ? 1 : 0;
  has_failed = true;
  return true;
}

void* counted(void* memory) {
  live += memory != nullptr;
  return memory;
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_malloc(size));
}
void* calloc(std::size_t count, std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_calloc(count, size));
}
void* realloc(void* memory, std::size_t size) {
  if (fails(__builtin_return_address(0))) return nullptr;
  if (!memory) return counted(__libc_realloc(memory, size));
  void* const moved = __libc_realloc(memory, size);
  live -= size == 0 && !moved;
  return moved;
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_memalign(alignment, size));
}
void* memalign(std::size_t alignment, std::size_t size) {  // OpenMP's runtime calls it
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_memalign(alignment, size));
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  if (fails(__builtin_return_address(0))) return ENOMEM;
  *memory = counted(__libc_memalign(alignment, size));
  return *memory ? 0 : ENOMEM;
}
void free(void* memory) {
  live -= memory != nullptr;
  __libc_free(memory);
}
}

namespace gradpsi {
namespace {

namespace fs = std::filesystem;

/// Whether only the n-th allocation fails or all from the n-th on, and with how many threads.
struct Failure {
  bool all;
  int threads;
  int lost = 0;  // allocations that Eigen may lose: see Solvers
};

/// Calls `call` with ever later failures. After each, `check` tells whether all is as before the call, and
/// `call` returns whether its result is right.
void fail_each(
    const Failure& failure, const std::function<bool()>& call,
    const std::function<bool()>& unchanged = [] { return true; }) {
  ASSERT_TRUE(call()) << "without failures";
  ASSERT_TRUE(call()) << "once more";  // what libraries keep for themselves is there now
  int exceptions = 0;
  for (long n = 1;; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n) + (failure.all ? " and all that follow" : ""));
    const long before = live;
    enum { Right, Wrong, NoMemory, Other } outcome;
    has_failed = false;
    from_then_on = failure.all;
    countdown = n;
    try {
      outcome = call() ? Right : Wrong;
    } catch (const std::bad_alloc&) {
      outcome = NoMemory;
    } catch (...) {
      outcome = Other;
    }
    countdown = 0;
    const long leaked = live - before;
    EXPECT_LE(leaked, failure.lost);  // less: a solver's workspace
    ASSERT_TRUE(outcome == Right || outcome == NoMemory) << outcome;
    ASSERT_TRUE(unchanged());
    if (!has_failed) break;
    exceptions += outcome == NoMemory;
    ASSERT_TRUE(call()) << "afterwards";
  }
  EXPECT_GT(exceptions, 0);
}

class Fault20 : public testing::TestWithParam<Failure> {
 protected:
  static void SetUpTestSuite() {
    if (spared_count == 0) dl_iterate_phdr(spare, nullptr);
  }
  int threads() const { return GetParam().threads; }
};

INSTANTIATE_TEST_SUITE_P(Failures, Fault20,
                         testing::Values(Failure{false, 1}, Failure{true, 1}, Failure{false, 2},
                                         Failure{true, 2}),
                         [](const auto& the_case) {
                           return std::string(the_case.param.all ? "all_from_then_on" : "one") +
                                  "_" + std::to_string(the_case.param.threads) + "_threads";
                         });

bool equal(const Cloud& a, const Cloud& b) {
  return a.positions() == b.positions() && a.volumes() == b.volumes() && a.box() == b.box();
}
bool equal(const Neighbours& a, const Neighbours& b) {
  return a.offsets == b.offsets && a.indices == b.indices && a.supports == b.supports;
}
bool equal(const SparseMatrix& a, const SparseMatrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
         std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.rows() + 1, b.outerIndexPtr()) &&
         std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr()) &&
         std::equal(a.valuePtr(), a.valuePtr() + a.nonZeros(), b.valuePtr());
}
bool equal(const std::vector<Operator>& a, const std::vector<Operator>& b) {
  return std::ranges::equal(a, b, [](const Operator& p, const Operator& q) {
    return p.volumes == q.volumes && p.rows.outcome == q.rows.outcome &&
           std::ranges::equal(p.axes, q.axes,
                              [](const auto& A, const auto& B) { return equal(A, B); });
  });
}

/// Points without volumes, so that those must be computed, more than a chunk of rows of them.
Cloud points(int dimension) {
  return Cloud(irregular_cloud(dimension, dimension == 3 ? 9 : 25).positions());
}

TEST_P(Fault20, Searches) {
  for (const int dimension : {1, 2, 3}) {
    const Cloud cloud = points(dimension), copy = cloud;
    const double support = 2.5 * cloud.spacing();
    const Neighbours near = find_neighbours(cloud, support);
    const Eigen::VectorXd volumes = number_density_volumes(cloud, near);
    const Eigen::VectorXd nearest = nearest_distances(cloud);
    const auto unchanged = [&] { return equal(cloud, copy); };
    fail_each(
        GetParam(), [&] { return equal(find_neighbours(cloud, support, threads()), near); },
        unchanged);
    fail_each(
        GetParam(),
        [&] { return number_density_volumes(cloud, near, kernels()[1], threads()).size() > 0; },
        unchanged);
    fail_each(
        GetParam(), [&] { return nearest_distances(cloud, threads()) == nearest; }, unchanged);
    fail_each(
        GetParam(), [&] { return std::ssize(reorder(cloud, threads()).order) == cloud.size(); },
        unchanged);
  }
}

TEST_P(Fault20, Assembly) {
  const std::vector<std::vector<Scheme>> all = {
      {"gradient-direct-soc"},
      {"laplacian-mixed-soc"},
      {"laplacian-positive"},
      {"laplacian-ls-4"},
      {"gradient-ls-2", "laplacian-ls-2", "laplacian-diffuse-zoc", "gradient-ls-5"}};
  struct Case {
    int points_per_side;
    double support_ratio;
    OnDegenerate policy;
  };
  // Several chunks of rows; and few points with too small a support, for policies to have something to do.
  for (const Case& c : {Case{25, 4.0, OnDegenerate::Lower}, Case{8, 2.0, OnDegenerate::Lower},
                        Case{8, 2.0, OnDegenerate::Widen}, Case{8, 2.0, OnDegenerate::Zero}}) {
    if (threads() > 1 && c.points_per_side < 25) continue;  // one chunk of rows, for one thread
    const Cloud cloud(irregular_cloud(2, c.points_per_side).positions()), copy = cloud;
    const Neighbours near = find_neighbours(cloud, c.support_ratio * cloud.spacing());
    const Neighbours near_copy = near;
    const AssemblyOptions options{.on_degenerate = c.policy, .threads = threads()};
    for (const auto& schemes : all) {
      SCOPED_TRACE(name(schemes[0]) + ", ratio " + std::to_string(c.support_ratio));
      const std::vector<Operator> expected = assemble(schemes, cloud, near, options);
      fail_each(
          GetParam(), [&] { return equal(assemble(schemes, cloud, near, options), expected); },
          [&] { return equal(cloud, copy) && equal(near, near_copy); });
    }
  }
}

TEST_P(Fault20, AssemblyThatFails) {
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 1.6 * cloud.spacing());
  fail_each(GetParam(), [&] {
    try {
      assemble("laplacian-mixed-soc", cloud, near, {.threads = threads()});
    } catch (const StencilError&) {
      return true;
    }
    return false;
  });
}

TEST_P(Fault20, Reassembly) {
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 4 * cloud.spacing());
  const AssemblyOptions options{.on_degenerate = OnDegenerate::Lower, .threads = threads()};
  for (const char* scheme : {"gradient-direct-soc", "laplacian-mixed-soc", "laplacian-ls-4"}) {
    Operator op = assemble(scheme, cloud, near, options);
    const std::vector<Operator> expected = {op};
    fail_each(
        GetParam(),
        [&] {
          reassemble(scheme, cloud, near, op, options);
          return op.volumes == expected[0].volumes && equal(op.matrix(), expected[0].matrix());
        },
        // Values may be old or new; the pattern stays.
        [&] {
          return op.axes.size() == expected[0].axes.size() &&
                 op.matrix().nonZeros() == expected[0].matrix().nonZeros();
        });
  }
}

/// (1 - dt lap) of a scheme: symmetric after scaling by volume for zoc, else not.
SparseMatrix implicit_matrix(const Operator& laplacian, double time_step) {
  SparseMatrix A = -time_step * laplacian.matrix();
  for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1;
  A.makeCompressed();
  return A;
}

// Matrices are passed by value. Eigen 3.4 has no move constructor for them, and its copy constructor loses
// the row offsets, one allocation, if there is no memory for the entries.
TEST_P(Fault20, Solvers) {
  Failure failure = GetParam();
  failure.lost = 1;
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 3.2 * cloud.spacing());
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(cloud.size(), 2), b_copy = b;
  struct Case {
    const char* scheme;
    Method method;
    double time_step;
  };
  for (const Case& c : {Case{"laplacian-mixed-zoc", Method::Cholesky, 1e-2},
                        Case{"laplacian-mixed-soc-ls", Method::Lu, 1e-3},
                        Case{"laplacian-mixed-soc-ls", Method::Krylov, 1e-4},
                        Case{"laplacian-mixed-zoc", Method::Krylov, 1.0},
                        Case{"laplacian-mixed-zoc", Method::Auto, 1e-2}}) {
    SCOPED_TRACE(std::string(c.scheme) + ", " + std::string(name(c.method)));
    const Operator op = assemble(c.scheme, cloud, near);
    const SystemPoints system{.cloud = Cloud(cloud.positions(), {.volumes = op.volumes})};
    const SparseMatrix A = implicit_matrix(op, c.time_step), copy = A;
    const SolverOptions options{.method = c.method, .threads = threads()};
    const auto right = [&](const Eigen::MatrixXd& x) {
      return (A * x - b).norm() < 1e-9 * b.norm();
    };
    const auto unchanged = [&] { return equal(A, copy) && b == b_copy; };
    fail_each(
        failure,
        [&] {
          LinearSolver solver(A, options, system);
          Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
          solver.solve(b, x);
          return right(x);
        },
        unchanged);
    LinearSolver solver(A, options, system);
    fail_each(
        failure,
        [&] {
          Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
          solver.refactor(A);
          solver.solve(b, x);
          return right(x);
        },
        unchanged);
  }
}

TEST_P(Fault20, Diffusion) {
  Failure failure = GetParam();
  failure.lost = 1;
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 3.2 * cloud.spacing());
  BoundaryConditions conditions;
  for (int i = 0; i < cloud.size(); ++i) {
    if (cloud.positions()(i, 0) < 0.05) conditions.fixed.points.push_back(i);
    if (cloud.positions()(i, 0) > 0.95) conditions.walls.points.push_back(i);
  }
  conditions.walls.normals = Eigen::RowVector2d(1, 0).replicate(conditions.walls.points.size(), 1);
  conditions.walls.gradient =
      assemble("gradient-direct-soc", cloud, near, {.rows = conditions.walls.points}).axes;
  const Operator laplacian = assemble("laplacian-mixed-soc-ls", cloud, near);
  const Eigen::MatrixXd u = Eigen::MatrixXd::Random(cloud.size(), 2);
  const DiffusionOptions options{.time_step = 1e-3, .theta = 0.5, .solver = {.threads = threads()}};
  ImplicitDiffusion heat(cloud, laplacian, conditions, options);
  Eigen::MatrixXd expected = u;
  heat.step(expected);
  const auto right = [&](const Eigen::MatrixXd& v) { return (v - expected).norm() < 1e-9; };
  fail_each(failure, [&] {
    ImplicitDiffusion one(cloud, laplacian, conditions, options);
    Eigen::MatrixXd v = u;
    one.step(v);
    return right(v);
  });
  // A step with another number of columns allocates.
  Eigen::MatrixXd v = u;
  Eigen::MatrixXd w = u.col(0);
  fail_each(
      failure,
      [&] {
        v = u, w = u.col(0);
        heat.step(w);
        heat.step(v);
        return right(v) && right((Eigen::MatrixXd(u.rows(), 2) << w, expected.col(1)).finished());
      },
      [&] { return v == u || right(v); });
}

TEST_P(Fault20, Diagnosis) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  const Operator op = assemble("laplacian-mixed-soc", cloud, near);
  std::vector<int> inside;
  for (int i = 0; i < cloud.size(); ++i)
    if (near.count(i) > 20) inside.push_back(i);
  fail_each(GetParam(), [&] {
    return diagnose("laplacian-mixed-soc", cloud, op).amplification.allFinite() &&
           summarise(op.matrix(), op.volumes).bandwidth > 0 &&
           forecast(cloud, op.matrix(), inside, op.volumes).rate < 1e9 &&
           spectrum(op.matrix()).complete && spectrum(op.matrix(), {}, 100).values.size() > 0;
  });
}

class Fault20Files : public Fault20 {
 protected:
  Fault20Files() {
    std::string name = testing::TempDir() + "gradpsi-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~Fault20Files() override { fs::remove_all(folder_); }
  fs::path path(const char* name) const { return folder_ / name; }
  static std::string content(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Fails in `write`, which writes these files: each is the old one or the new one afterwards.
  void fail_writing(const std::vector<fs::path>& files, const std::function<void()>& write) {
    write();
    std::vector<std::string> whole;
    for (const fs::path& file : files) whole.push_back(content(file));
    fail_each(
        GetParam(),
        [&] {
          for (const fs::path& file : files) fs::resize_file(file, 3);
          write();
          return fs::file_size(files[0]) == whole[0].size();
        },
        [&] {
          bool all = true;
          for (std::size_t k = 0; k < files.size(); ++k)
            all &= fs::file_size(files[k]) == 3 || content(files[k]) == whole[k];
          return all && std::distance(fs::directory_iterator(folder_), {}) == std::ssize(files);
        });
  }

 private:
  fs::path folder_;
};

INSTANTIATE_TEST_SUITE_P(Failures, Fault20Files,
                         testing::Values(Failure{false, 1}, Failure{true, 1}),
                         [](const auto& the_case) {
                           return std::string(the_case.param.all ? "all_from_then_on" : "one");
                         });

TEST_P(Fault20Files, Tables) {
  Table table{{"x", "y", "T", "a name that is longer than a string's own memory"},
              Eigen::MatrixXd::Random(50, 4)};
  fail_writing({path("t.csv")}, [&] { write_csv(path("t.csv"), table); });
  fail_each(GetParam(), [&] {
    const Table read = read_csv(path("t.csv"));
    return read.names == table.names && read.values == table.values &&
           make_cloud(read).dimension() == 2;
  });
  fs::remove(path("t.csv"));
  fail_writing({path("t.vtu")}, [&] { write_vtu(path("t.vtu"), table); });
}

TEST_P(Fault20Files, Matrices) {
  const Cloud cloud = irregular_cloud(2, 6);
  const auto axes =
      assemble("gradient-direct-soc", cloud, find_neighbours(cloud, 3 * cloud.spacing())).axes;
  const std::vector<fs::path> files = {path("a_x.mtx"), path("a_y.mtx")};
  fail_writing(files, [&] { write_matrix_market(files, axes); });
  fail_each(GetParam(), [&] { return equal(read_matrix_market(files[0]), axes[0]); });
}

}  // namespace
}  // namespace gradpsi
