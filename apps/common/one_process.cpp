#include <utility>

#include "common/machine.hpp"
#include "common/outputs.hpp"
#include "common/picture.hpp"
#include "common/remedy.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

class OneProcess : public Machine {
 public:
  OneProcess() : problem_(own_) {}
  explicit OneProcess(Problem& problem) : problem_(problem) {}

  void read(const OperatorOptions& options, Report& report) override {
    problem_ = read_problem(options, report);
  }
  const Table& table() const override { return problem_.table; }
  const Cloud& cloud() const override { return problem_.cloud; }
  const std::string& axes() const override { return problem_.axes; }

  void find_neighbours(const OperatorOptions& options, Report& report) override {
    apps::find_neighbours(options, problem_, report);
  }
  Operator choose_rows(const OperatorOptions& options, const std::vector<int>& unused, bool stable,
                       Report& report) override {
    return apps::choose_rows(options, problem_, unused, stable, report);
  }
  Operator assemble(const Scheme& scheme, const AssemblyOptions& options) override {
    return gradpsi::assemble(scheme, problem_.cloud, problem_.near, options);
  }
  void require(const Scheme& scheme, const Operator& op,
               const std::vector<int>& except) const override {
    gradpsi::require(scheme, problem_.cloud, op, except);
  }
  std::string remedy(const Scheme& scheme, const AssemblyOptions& options) const override {
    return apps::remedy(scheme, problem_, options, options.rows.value_or(std::vector<int>()));
  }
  void describe(const Operator& op, Report& report) const override {
    apps::describe(op, problem_, report);
  }
  WithWalls with_walls(Operator laplacian, const FluxWalls& walls, int threads) override {
    return gradpsi::with_walls(std::move(laplacian), problem_.cloud, problem_.near, walls, threads);
  }
  Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity,
                             Mean mean) override {
    return gradpsi::with_conductivity(std::move(laplacian), conductivity, mean);
  }
  bool keeps_neighbours() const override { return true; }
  Diffusion diffusion(Operator laplacian, const BoundaryConditions& conditions,
                      const DiffusionOptions& options) override {
    const auto heat = std::make_shared<ImplicitDiffusion>(problem_.cloud, std::move(laplacian),
                                                          conditions, options);
    return {[heat](Eigen::VectorXd& u) { return heat->step(u); },
            [heat](Eigen::VectorXd& u) { return heat->damped_step(u); },
            [heat] { return heat->solver(); }};
  }

  const Table& table_with(const std::string& name, const Eigen::VectorXd& u) override {
    problem_.table.set(name, u);
    return problem_.table;
  }
  std::string ending() const override { return ".vtu"; }
  std::vector<path> parts(const path& file) const override { return {file}; }
  void write(const OperatorOptions& options, const path& file, const Table& table) override {
    check_outputs(options, {file});
    write_table(file, table);
  }
  bool draw(const path& picture, const Table& table, const std::string& name,
            const std::string& title) override {
    return draw_field(picture, problem_.cloud.positions(), table.column(name), name, title);
  }

 private:
  Problem own_{Points{{}, Cloud(Positions(0, 1))}};
  Problem& problem_;
};

}  // namespace

std::unique_ptr<Machine> one_process() { return std::make_unique<OneProcess>(); }
std::unique_ptr<Machine> one_process(Problem& problem) {
  return std::make_unique<OneProcess>(problem);
}

}  // namespace gradpsi::apps
