// Implicit steps by several processes: what each stage takes, how large halos are, and what memory is needed.
// A CSV line, its largest values over the processes.
//
//     mpirun -n R gradpsi_mpi_benchmark DIMENSION POINTS_PER_SIDE DT_NU_OVER_DX2 SCHEME [--partition-only]
//         [PETSc's options]
//
// Points are a lattice jittered by 0.2 cells, its outermost layer fixed; process r starts with the r-th part
// of them in the lattice's order. h/dx = 3 in 2D and 2.6 in 3D; the tolerance is 1e-8, as in
// gradpsi_diffusion_benchmark. Three steps are made, of a field without large scales only; their median counts.

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <gradpsi/petsc.hpp>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace petsc = gradpsi::petsc;
MPI_Comm comm() { return PETSC_COMM_WORLD; }

int rank() {
  int rank;
  MPI_Comm_rank(comm(), &rank);
  return rank;
}

int ranks() {
  int count;
  MPI_Comm_size(comm(), &count);
  return count;
}

/// Of all processes' values, by MPI_SUM or MPI_MAX.
double reduced(double value, MPI_Op operation) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, operation, comm());
  return value;
}
double largest(double value) { return reduced(value, MPI_MAX); }
double mean(double value) { return reduced(value, MPI_SUM) / ranks(); }

double noise(std::uint64_t x) {  // -1 to 1
  x *= 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return std::ldexp(static_cast<double>((x ^ x >> 31) >> 11), -52) - 1;
}

gradpsi::Cloud share(int dimension, int side) {
  std::int64_t n = 1;
  for (int a = 0; a < dimension; ++a) n *= side;
  const std::int64_t begin = n * rank() / ranks(), end = n * (rank() + 1) / ranks();
  gradpsi::Positions x(end - begin, dimension);
  for (std::int64_t i = begin; i < end; ++i) {
    std::int64_t rest = i;
    for (int a = dimension - 1; a >= 0; --a, rest /= side)
      x(i - begin, a) = (static_cast<double>(rest % side) + 0.5 + 0.2 * noise(3 * i + a)) / side;
  }
  const double volume = std::pow(1.0 / side, dimension);
  return gradpsi::Cloud(std::move(x), {.volumes = Eigen::VectorXd::Constant(end - begin, volume)});
}

/// Seconds since the last call, of the slowest process.
class Stages {
 public:
  void end(const std::string& name) {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - std::exchange(last_, now)).count();
    names.push_back(name);
    times.push_back(largest(seconds));
  }
  std::vector<std::string> names;
  std::vector<double> times;

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

double peak_megabytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return largest(static_cast<double>(usage.ru_maxrss) / 1024);
}

struct Settings {
  int dimension, side;
  double ratio;  ///< dt nu / dx^2
  std::string scheme;
  bool partition_only;

  double dx() const { return 1.0 / side; }
  Eigen::VectorXd support() const {
    return Eigen::VectorXd::Constant(1, (dimension == 3 ? 2.6 : 3) * dx());
  }
};

/// What is measured beside the stages' times.
struct Solution {
  double iterations = 0, entries = 0;
  std::string description;
};

/// Points within a cell of the surface: the outermost layer.
gradpsi::FixedValues outermost(const petsc::Subdomain& mine, double dx) {
  gradpsi::FixedValues fixed;
  for (const int i : mine.own()) {
    const auto x = mine.cloud().positions().row(i);
    if (x.minCoeff() < dx || x.maxCoeff() > 1 - dx) fixed.points.push_back(i);
  }
  return fixed;
}

Eigen::VectorXd field(const petsc::Subdomain& mine) {
  Eigen::VectorXd u(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    const auto x = mine.cloud().positions().row(mine.own()[k]);
    u[k] = std::sin(3 * x[0]) * std::cos(5 * x[x.size() - 1]) +
           noise(static_cast<std::uint64_t>(mine.cloud().number(mine.own()[k])));
  }
  return u;
}

Solution solve(const Settings& settings, const petsc::Subdomain& mine, Stages& stages) {
  Solution result;
  const double dx = settings.dx();
  gradpsi::Neighbours near = petsc::find_neighbours(mine, settings.support(), 1);
  stages.end("search");
  gradpsi::Operator laplacian = petsc::assemble(
      settings.scheme, mine, near, {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = 1});
  near = {};
  stages.end("weights");
  result.entries = reduced(static_cast<double>(laplacian.matrix().nonZeros()), MPI_SUM);
  petsc::ImplicitDiffusion heat(
      mine, std::move(laplacian), {.fixed = outermost(mine, dx)},
      {.time_step = settings.ratio * dx * dx, .solver = {.tolerance = 1e-8, .threads = 1}});
  stages.end("setup");
  result.description = heat.solver().description;
  Eigen::VectorXd u = field(mine);
  std::vector<double> seconds;
  for (int n = 0; n < 3; ++n) {
    const gradpsi::SolveReport report = heat.step(u);
    seconds.push_back(largest(report.seconds));
    result.iterations = report.iterations;
  }
  std::ranges::sort(seconds);
  stages.end("steps");
  stages.times.back() = seconds[1];
  return result;
}

void print(const Settings& settings, const petsc::Subdomain& mine, const Stages& stages,
           const Solution& solution, double megabytes_before) {
  const double megabytes = peak_megabytes();
  const auto halo = static_cast<double>(mine.cloud().size() - std::ssize(mine.own()));
  const double halo_mean = mean(halo), halo_most = largest(halo);
  const double sources = mean(mine.sources()), most_sources = largest(mine.sources());
  if (rank() > 0) return;
  std::printf("ranks,dimension,points,dt_nu_over_dx2,scheme");
  for (const std::string& name : stages.names) std::printf(",%s", name.c_str());
  std::printf(
      ",iterations,entries,halo_mean,halo_most,sources_mean,sources_most,start_MB,peak_MB,"
      "solver\n");
  std::printf("%d,%d,%lld,%g,%s", ranks(), settings.dimension,
              static_cast<long long>(mine.partition().size()), settings.ratio,
              settings.scheme.c_str());
  for (const double seconds : stages.times) std::printf(",%.4g", seconds);
  std::printf(",%g,%.0f,%.0f,%.0f,%.3g,%.0f,%.0f,%.0f,\"%s\"\n", solution.iterations,
              solution.entries, halo_mean, halo_most, sources, most_sources, megabytes_before,
              megabytes, solution.description.c_str());
}

void run(const Settings& settings) {
  const double megabytes_before = peak_megabytes();
  gradpsi::Cloud given = share(settings.dimension, settings.side);
  MPI_Barrier(comm());
  Stages stages;
  const petsc::Partition partition(comm(), given);
  given = gradpsi::Cloud(gradpsi::Positions(0, settings.dimension));
  stages.end("partition");
  const petsc::Subdomain mine(partition, settings.support());
  stages.end("halo");
  Solution solution;
  if (!settings.partition_only) solution = solve(settings, mine, stages);
  print(settings, mine, stages, solution, megabytes_before);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "usage: %s DIMENSION POINTS_PER_SIDE DT_NU_OVER_DX2 SCHEME [--partition-only]\n",
                 argv[0]);
    return 2;
  }
  const Settings settings{.dimension = std::atoi(argv[1]),
                          .side = std::atoi(argv[2]),
                          .ratio = std::atof(argv[3]),
                          .scheme = argv[4],
                          .partition_only = argc > 5 && std::string(argv[5]) == "--partition-only"};
  int petsc_count = argc - 4;
  char** petsc_options = argv + 4;
  if (PetscInitialize(&petsc_count, &petsc_options, nullptr, nullptr) != 0) return 1;
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
  int code = 0;
  try {
    run(settings);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    code = 1;
  }
  PetscFinalize();
  return code;
}
