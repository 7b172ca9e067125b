#pragma once

#include <functional>
#include <string>

#include "common/diffuse_options.hpp"
#include "common/machine.hpp"

// The steps of `diffuse`, and what is said of them.

namespace gradpsi::apps {

Range range(const Machine& machine, const Eigen::VectorXd& u);

/// Where diffusion keeps a field without sources and fluxes: in its range, that of the surroundings included.
Range lawful_range(const Machine& machine, const Eigen::VectorXd& u, const Diffusion& heat);

/// All steps from `start` to u; done(n) is called after the n-th. If the field grows as no diffusion does, throws what can be done
/// about it: what has been tried.
Steps make_steps(const DiffuseOptions& options, Machine& machine, const Diffusion& heat,
                 const Eigen::VectorXd& start, Eigen::VectorXd& u,
                 const std::function<void(int)>& done);

/// Lines about a field that has left its range without sources and walls to make it, and what helps: it has
/// been tried. "": it has not.
std::string range_note(const DiffuseOptions& options, Machine& machine, const Diffusion& heat,
                       const Eigen::VectorXd& start, const Range& after);

/// Says what it was solved with, and what became of the range.
void print_solution(const DiffuseOptions& options, const SolverReport& solver, const Steps& steps,
                    const Range& before, const Range& after, const std::string& note);

}  // namespace gradpsi::apps
