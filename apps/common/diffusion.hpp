#pragma once

#include <functional>
#include <string>

#include "common/diffuse_options.hpp"
#include "common/machine.hpp"

// What `diffuse` does between the points and the results.

namespace gradpsi::apps {

/// A column of the points, all its values finite.
Eigen::VectorXd column(const Machine& machine, const std::string& name);

/// The system to be stepped: assembles the Laplacian, and the gradient at walls with a flux.
Diffusion diffusion(const DiffuseOptions& options, Machine& machine, Report& report);

/// All steps; done(n) is called after the n-th.
Steps make_steps(const DiffuseOptions& options, const Machine& machine, const Diffusion& heat,
                 Eigen::VectorXd& u, const std::function<void(int)>& done);

/// The least and the largest value of a field.
struct Range {
  double least, most;
};
Range range(const Machine& machine, const Eigen::VectorXd& u);

/// Says what it was solved with, and what became of the range.
void print_solution(const DiffuseOptions& options, const SolverReport& solver, const Steps& steps,
                    const Range& before, const Range& after, double gentle_step);

}  // namespace gradpsi::apps
