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
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <gradpsi/petsc.hpp>
#include <string>
#include <vector>

#include "../lib/base/stopwatch.hpp"
#include "../lib/petsc/collective.hpp"

namespace {

namespace petsc = gradpsi::petsc;
MPI_Comm comm() { return PETSC_COMM_WORLD; }

double noise(std::uint64_t x) {  // -1 to 1
  x *= 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return std::ldexp(static_cast<double>((x ^ x >> 31) >> 11), -52) - 1;
}

gradpsi::Cloud share(int dimension, int side) {
  std::int64_t n = 1;
  for (int a = 0; a < dimension; ++a) n *= side;
  const int rank = petsc::rank_of(comm()), all = petsc::processes(comm());
  const std::int64_t begin = n * rank / all, end = n * (rank + 1) / all;
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
    const double seconds = petsc::largest_of(comm(), watch_.lap());
    names.push_back(name);
    times.push_back(seconds);
  }
  std::vector<std::string> names;
  std::vector<double> times;

 private:
  gradpsi::Stopwatch watch_;
};

double peak_megabytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return petsc::largest_of(comm(), static_cast<double>(usage.ru_maxrss) / 1024);
}

void run(int dimension, int side, double ratio, const std::string& scheme, bool partition_only) {
  const double dx = 1.0 / side;
  const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, (dimension == 3 ? 2.6 : 3) * dx);
  const double before = peak_megabytes();
  gradpsi::Cloud given = share(dimension, side);
  MPI_Barrier(comm());
  Stages stages;
  const petsc::Partition partition(comm(), given);
  given = gradpsi::Cloud(gradpsi::Positions(0, dimension));
  stages.end("partition");
  const petsc::Subdomain mine(partition, support);
  stages.end("halo");
  const int own = static_cast<int>(mine.own().size()), halo = mine.cloud().size() - own;
  double iterations = 0, entries = 0;
  std::string description;
  if (!partition_only) {
    gradpsi::Neighbours near = petsc::find_neighbours(mine, support, 1);
    stages.end("search");
    gradpsi::Operator laplacian = petsc::assemble(
        scheme, mine, near, {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = 1});
    near = {};
    stages.end("weights");
    entries = petsc::sum_of(comm(), static_cast<double>(laplacian.matrix().nonZeros()));
    gradpsi::FixedValues fixed;
    for (const int i : mine.own()) {
      const auto x = mine.cloud().positions().row(i);
      if (x.minCoeff() < dx || x.maxCoeff() > 1 - dx) fixed.points.push_back(i);
    }
    petsc::ImplicitDiffusion heat(
        mine, std::move(laplacian), {.fixed = fixed},
        {.time_step = ratio * dx * dx, .solver = {.tolerance = 1e-8, .threads = 1}});
    stages.end("setup");
    description = heat.solver().description;
    Eigen::VectorXd u(own);
    for (int k = 0; k < own; ++k) {
      const auto x = mine.cloud().positions().row(mine.own()[k]);
      u[k] = std::sin(3 * x[0]) * std::cos(5 * x[dimension - 1]) +
             noise(static_cast<std::uint64_t>(partition.cloud().number(k)));
    }
    std::vector<double> seconds;
    for (int n = 0; n < 3; ++n) {
      const gradpsi::SolveReport report = heat.step(u);
      seconds.push_back(petsc::largest_of(comm(), report.seconds));
      iterations = report.iterations;
    }
    std::ranges::sort(seconds);
    stages.end("steps");
    stages.times.back() = seconds[1];
  }
  const double megabytes = peak_megabytes();
  const double halo_mean = petsc::sum_of(comm(), double(halo)) / petsc::processes(comm());
  const double halo_most = petsc::largest_of(comm(), double(halo));
  const double sources = petsc::sum_of(comm(), double(mine.sources())) / petsc::processes(comm());
  const int most_sources = petsc::largest_of(comm(), mine.sources());
  if (petsc::rank_of(comm()) > 0) return;
  std::printf("ranks,dimension,points,dt_nu_over_dx2,scheme");
  for (const std::string& name : stages.names) std::printf(",%s", name.c_str());
  std::printf(
      ",iterations,entries,halo_mean,halo_most,sources_mean,sources_most,start_MB,peak_MB,"
      "solver\n");
  std::printf("%d,%d,%lld,%g,%s", petsc::processes(comm()), dimension,
              static_cast<long long>(partition.size()), ratio, scheme.c_str());
  for (const double seconds : stages.times) std::printf(",%.4g", seconds);
  std::printf(",%g,%.0f,%.0f,%.0f,%.3g,%d,%.0f,%.0f,\"%s\"\n", iterations, entries, halo_mean,
              halo_most, sources, most_sources, before, megabytes, description.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "usage: %s DIMENSION POINTS_PER_SIDE DT_NU_OVER_DX2 SCHEME [--partition-only]\n",
                 argv[0]);
    return 2;
  }
  const bool partition_only = argc > 5 && std::string(argv[5]) == "--partition-only";
  const int dimension = std::atoi(argv[1]), side = std::atoi(argv[2]);
  const double ratio = std::atof(argv[3]);
  const std::string scheme = argv[4];
  int petsc_count = argc - 4;
  char** petsc_options = argv + 4;
  if (PetscInitialize(&petsc_count, &petsc_options, nullptr, nullptr) != 0) return 1;
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
  int code = 0;
  try {
    run(dimension, side, ratio, scheme, partition_only);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    code = 1;
  }
  PetscFinalize();
  return code;
}
