#include "mpi/machine.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <gradpsi/petsc.hpp>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "common/outputs.hpp"
#include "common/stopwatch.hpp"
#include "mpi/describe.hpp"
#include "mpi/given.hpp"
#include "mpi/outputs.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

/// Reports and prints the warnings of the first process that has any; they are of its own points.
void warn_together(std::vector<std::string> warnings, Report& report) {
  std::vector<char> joined;
  const std::int64_t speaker =
      reduced(std::int64_t{warnings.empty() ? processes() : rank()}, MPI_MIN);
  if (rank() == speaker)
    for (const std::string& warning : warnings) {
      joined.insert(joined.end(), warning.begin(), warning.end());
      joined.push_back('\n');
    }
  const std::vector<char> text = gathered(joined);
  std::istringstream lines(std::string(text.begin(), text.end()));
  for (std::string line; std::getline(lines, line);) {
    std::cerr << "warning: " << line << '\n';
    report.warnings.push_back(line);
  }
}

class SeveralProcesses : public Machine {
 public:
  bool is_first() const override { return rank() == 0; }
  void together(const std::function<void()>& work) const override { petsc::together(comm(), work); }
  std::int64_t sum(std::int64_t value) const override { return reduced(value, MPI_SUM); }
  double least(double value) const override { return reduced(value, MPI_MIN); }
  double largest(double value) const override { return reduced(value, MPI_MAX); }

  void read(const OperatorOptions& options, Report& report) override {
    Stopwatch watch;
    given_ = read_share(options);
    own_ = {given_.table.names, partition().to_owners(given_.table.values)};
    if (is_first()) warn(given_.notes, report);
    report.points = given_.all;
    report.dropped_points = given_.dropped;
    report.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
    report.processes = processes();
    report.seconds.read = watch.lap();
  }
  const Table& table() const override { return own_; }
  const Cloud& cloud() const override { return partition().cloud(); }
  const std::string& axes() const override { return given_.axes; }

  void find_neighbours(const OperatorOptions& options, Report& report) override {
    Stopwatch watch;
    const auto spacing = [&]() -> DenseVector {
      const bool empty = partition().size() == 0;
      return DenseVector::Constant(1, empty ? 1 : petsc::spacing(partition(), options.threads));
    };
    if (options.tolerance) return;
    if (options.symmetric_support) throw BadUsage("--symmetric-support", "is for one process");
    const Eigen::VectorXd h = supports(options, own_, {.spacing = spacing});
    const bool widens = assembly_options(options, own_).on_degenerate == OnDegenerate::Widen;
    const double rows = reach(Scheme(options.scheme)) * (widens ? widest : 1);
    // What is no support is refused by find_neighbours(), which names the point.
    Eigen::VectorXd reaches = h.unaryExpr([&](double x) { return x > 0 ? rows * x : 0; });
    for (const double length : options.periodic)
      if (length > 0) reaches = reaches.cwiseMin(length / 2).cwiseMax(h);
    mine_.emplace(partition(), reaches);
    near_ = petsc::find_neighbours(*mine_, h, options.threads);
    std::vector<std::string> found;
    together([&] { found = warnings(mine_->cloud(), near_, options.threads); });
    warn_together(std::move(found), report);
    report.seconds.search = watch.lap();
  }
  std::vector<int> places(std::vector<int> points) const override {
    for (int& point : points) point = mine_->own()[point];
    return points;
  }
  Operator assemble(const Scheme& scheme, const AssemblyOptions& options) override {
    return petsc::assemble(scheme, *mine_, near_, options);
  }
  void require(const Scheme& scheme, const Operator& op,
               const std::vector<int>& except) const override {
    together([&] { gradpsi::require(scheme, mine_->cloud(), op, except); });
  }
  std::string remedy(const Scheme&, const AssemblyOptions&) const override { return ""; }
  void describe(const Operator& op, Report& report) const override {
    describe_together(op, *mine_, near_, report);
  }
  WithWalls with_walls(Operator laplacian, const FluxWalls& walls, int threads) override {
    WithWalls result;
    together([&] {
      result = gradpsi::with_walls(std::move(laplacian), mine_->cloud(), near_, walls, threads);
      result.source = DenseVector(result.source(mine_->own()));
    });
    return result;
  }
  Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity,
                             Mean mean) override {
    return petsc::with_conductivity(std::move(laplacian), *mine_, conductivity, mean);
  }
  bool keeps_neighbours() const override { return false; }  // their memory is needed
  Diffusion diffusion(Operator laplacian, const BoundaryConditions& conditions,
                      const DiffusionOptions& options) override {
    near_ = {};
    const auto heat = std::make_shared<petsc::ImplicitDiffusion>(*mine_, std::move(laplacian),
                                                                 conditions, options);
    return {[heat](Eigen::VectorXd& u) { return heat->step(u); },
            [heat](Eigen::VectorXd& u) { return heat->damped_step(u); },
            [heat] { return heat->solver(); }};
  }

  const Table& table_with(const std::string& name, const Eigen::VectorXd& u) override {
    given_.table.set(name, partition().to_givers(u));
    return given_.table;
  }
  std::string ending() const override { return ".pvtu"; }
  std::vector<path> parts(const path& file) const override { return parts_of(file); }
  void write(const OperatorOptions& options, const path& file, const Table& table) override {
    file.extension() == ".csv" ? write_csv_together(file, table)
                               : write_pieces(options, file, table);
  }
  bool draw(const path& picture, const Table& table, const std::string& name,
            const std::string& title) override {
    return draw_together(picture, given_, table, name, title);
  }

 private:
  const petsc::Partition& partition() const { return *given_.partition; }

  Given given_;
  Table own_;
  std::optional<petsc::Subdomain> mine_;
  Neighbours near_;
};

}  // namespace

std::unique_ptr<Machine> several_processes() { return std::make_unique<SeveralProcesses>(); }

}  // namespace gradpsi::apps
