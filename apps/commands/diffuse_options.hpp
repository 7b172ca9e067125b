#pragma once

#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/operator_options.hpp"

namespace gradpsi::apps {

/// What `gradpsi diffuse` and `gradpsi-mpi diffuse` have in common: options, the equation they stand for, the
/// steps, and what is said in the end.
struct DiffuseOptions : OperatorOptions {
  std::string field;
  double diffusivity = 1;
  std::optional<double> time_step;
  std::optional<int> steps;
  bool steady = false;
  double theta = 1;
  std::string fixed, normal, flux, gradient = "gradient-direct-soc";
  std::string conductivity, mean = "arithmetic";
  std::string source;
  std::string method = "auto";
  double memory = 0;  // GB
  std::optional<int> every;
  std::filesystem::path output;

  /// Declares all of them.
  /// @param program  how it is called
  void declare_diffusion(Options& options, const std::string& output_words,
                         const std::string& program);
  /// Throws what can be said before there are points.
  void check() const;
  /// A file beside the output: OUT and this ending.
  std::filesystem::path beside(const std::string& ending) const;
  /// Whether a field is to be kept after this step.
  bool keeps(int step) const;
  /// OUT_007 for step 7 of hundreds, and an ending.
  std::filesystem::path numbered(int step, const std::string& ending) const;
  /// The title of the picture.
  std::string title() const;

 private:
  void declare_field(Options& options);
  Option declare_steps(Options& options);
  void declare_conditions(Options& options);
  void declare_materials(Options& options);
  void declare_solver(Options& options);
};

/// Fixed points, and those with a normal that are not fixed, by their places in the table; gradients are
/// still empty.
gradpsi::BoundaryConditions boundary(const DiffuseOptions& options, const gradpsi::Table& table,
                                     const gradpsi::Cloud& cloud);

/// What to try when the walls' gradient cannot be computed.
std::string gradient_advice(const gradpsi::StencilError& error);
/// What is said if some of the walls' rows were not computed as asked.
std::string gradient_note(const DiffuseOptions& options, std::int64_t degenerate,
                          std::int64_t rows);

/// The equation and how it is solved.
gradpsi::DiffusionOptions equation(const DiffuseOptions& options, const gradpsi::Table& table,
                                   const gradpsi::Cloud& cloud);
/// Of the conductivities.
gradpsi::Mean mean(const DiffuseOptions& options);

/// How the steps are made, perhaps by several processes.
struct Stepper {
  std::function<gradpsi::SolveReport(Eigen::VectorXd&)> step;  ///< u becomes that of the next time
  std::function<double(double)> largest;                       ///< of all processes' numbers
  bool shows_progress = true;
};

/// All steps; done(n) is called after the n-th. What they took together, for the report.
nlohmann::ordered_json solve(const DiffuseOptions& options, const Stepper& stepper,
                             Eigen::VectorXd& u, const std::function<void(int)>& done);

/// The report's part on the solver.
nlohmann::ordered_json json(const gradpsi::SolverReport& solver);

/// The least and the largest value of a field.
struct Range {
  double least, most;
};
Range range(const Eigen::VectorXd& u);

/// Says what it was solved with, what became of the range, and where the picture is.
void print_solution(const DiffuseOptions& options, const gradpsi::SolverReport& solver,
                    const nlohmann::ordered_json& steps, const Range& before, const Range& after,
                    const std::filesystem::path& picture, bool drawn);

}  // namespace gradpsi::apps
