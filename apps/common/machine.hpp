#pragma once

#include <functional>
#include <gradpsi/diffusion.hpp>
#include <gradpsi/walls.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/operators.hpp"

namespace gradpsi::apps {

/// The least and the largest value of a field; of none, the other way round.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
};

/// Implicit steps: step(u) replaces u by that of the next time.
struct Diffusion {
  std::function<SolveReport(Eigen::VectorXd& u)> step;
  /// In place of the first: ImplicitDiffusion::damped_step().
  std::function<SolveReport(Eigen::VectorXd& u)> damped_step;
  std::function<SolverReport()> solver;
  /// The largest time step with which the theta method cannot overshoot: where no weight is negative.
  double gentle_step = 0;
  /// How far sources and walls can move the field in a step, or in the steady state; infinity: not known.
  double drift = 0;
  /// What exchange with the surroundings draws the field to.
  Range surroundings = {};
  /// What there is to say of the walls' rows.
  std::vector<std::string> remarks = {};
  /// Relative residuals after each iteration of the latest step; empty where none are told.
  std::shared_ptr<std::vector<double>> convergence = {};
};

/// The stages of a command, as one process or several that share the points take them. All processes call all
/// functions, in the same order; points are each process's own ones.
class Machine {
 public:
  virtual ~Machine() = default;

  /// Whether this process is the one that prints and writes what there is only one of.
  virtual bool is_first() const { return true; }
  /// Calls work(); if it fails in any process, all of them throw.
  virtual void together(const std::function<void()>& work) const { work(); }
  /// Of all processes' values.
  virtual std::int64_t sum(std::int64_t value) const { return value; }
  virtual double least(double value) const { return value; }
  virtual double largest(double value) const { return value; }

  /// Reads the points, and begins the report.
  virtual void read(const OperatorOptions& options, Report& report) = 0;
  virtual const Table& table() const = 0;
  virtual const Cloud& cloud() const = 0;
  /// What the cloud's coordinates are called in the table: differing_axes().
  virtual const std::string& axes() const = 0;

  /// Finds the neighbours, and warns on standard error of what about the points deserves it.
  virtual void find_neighbours(const OperatorOptions& options, Report& report) = 0;
  /// What operators and conditions call the points.
  virtual std::vector<int> places(std::vector<int> points) const { return points; }
  /// See apps::choose_rows().
  virtual Operator choose_rows(const OperatorOptions&, const std::vector<int>&, bool, Report&) {
    throw BadUsage("--tolerance", "is for one process");
  }
  virtual Operator assemble(const Scheme& scheme, const AssemblyOptions& options) = 0;
  /// Throws for degenerate rows that are not of these points.
  virtual void require(const Scheme& scheme, const Operator& op,
                       const std::vector<int>& except) const = 0;
  /// What can be done about degenerate rows, "; " before it: remedy().
  virtual std::string remedy(const Scheme& scheme, const AssemblyOptions& options) const = 0;
  /// Reports an operator of all points.
  virtual void describe(const Operator& op, Report& report) const = 0;
  /// with_walls(), the source at the process's own points.
  virtual WithWalls with_walls(Operator laplacian, const FluxWalls& walls, int threads) = 0;
  virtual Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity,
                                     Mean mean) = 0;
  /// Whether the neighbours are still there after diffusion().
  virtual bool keeps_neighbours() const = 0;
  /// The last stage.
  virtual Diffusion diffusion(Operator laplacian, const BoundaryConditions& conditions,
                              const DiffusionOptions& options) = 0;

  /// The table as the file has it, one column replaced by u.
  virtual const Table& table_with(const std::string& name, const Eigen::VectorXd& u) = 0;
  /// What files for ParaView end in.
  virtual std::string ending() const = 0;
  /// All files that are written for this one.
  virtual std::vector<std::filesystem::path> parts(const std::filesystem::path& file) const = 0;
  /// Writes a table that table_with() has given.
  virtual void write(const OperatorOptions& options, const std::filesystem::path& file,
                     const Table& table) = 0;
  /// A picture of one of its columns.
  /// @return  whether there is one
  virtual bool draw(const std::filesystem::path& picture, const Table& table,
                    const std::string& name, const std::string& title) = 0;
};

/// This process alone.
std::unique_ptr<Machine> one_process();
/// The same with points that have been read.
std::unique_ptr<Machine> one_process(Problem& problem);

}  // namespace gradpsi::apps
