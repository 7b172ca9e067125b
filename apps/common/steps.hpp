#pragma once

#include <functional>

#include "common/diffuse_options.hpp"
#include "common/machine.hpp"

// The steps of `diffuse`, and what is said of them.

namespace gradpsi::apps {

/// The least and the largest value of a field.
struct Range {
  double least, most;
};
Range range(const Machine& machine, const Eigen::VectorXd& u);

/// All steps; done(n) is called after the n-th. If the field grows as no diffusion does, throws what can be done
/// about it: what has been tried.
Steps make_steps(const DiffuseOptions& options, Machine& machine, const Diffusion& heat,
                 Eigen::VectorXd& u, const std::function<void(int)>& done);

/// Says what it was solved with, and what became of the range.
void print_solution(const DiffuseOptions& options, const SolverReport& solver, const Steps& steps,
                    const Range& before, const Range& after, double gentle_step);

}  // namespace gradpsi::apps
