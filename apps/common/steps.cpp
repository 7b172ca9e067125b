#include "common/steps.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
#include <vector>

#include "common/diffusion.hpp"
#include "common/growth.hpp"
#include "common/progress.hpp"

namespace gradpsi::apps {

Range range(const Machine& machine, const Eigen::VectorXd& u) {
  if (machine.sum(u.size()) == 0) return {0, 0};
  constexpr double none = std::numeric_limits<double>::max();
  return {machine.least(u.size() > 0 ? u.minCoeff() : none),
          machine.largest(u.size() > 0 ? u.maxCoeff() : -none)};
}

Range lawful_range(const Machine& machine, const Eigen::VectorXd& u, const Diffusion& heat) {
  const Range own = range(machine, u), &around = heat.surroundings;
  return {std::min(own.least, around.least), std::max(own.most, around.most)};
}

namespace {

/// What a step's field is called in messages.
std::string field_after(const DiffuseOptions& options, int step) {
  return options.steady ? "the steady " + options.field
                        : "step " + std::to_string(step) + ": " + options.field;
}

/// Replaces u by that of the next time.
SolveReport advance(const DiffuseOptions& options, const Diffusion& heat, int step,
                    Eigen::VectorXd& u) {
  const bool damped = options.damped_start && !options.steady && step == 1;
  return damped ? heat.damped_step(u) : heat.step(u);
}

/// Other options with which the field may not grow, and how they are spelt.
struct WayOut {
  DiffuseOptions options;
  std::string words;
};

/// Rows that let nothing grow: at walls first, if they are others, then inside.
std::vector<WayOut> ways_out(const DiffuseOptions& options) {
  std::vector<WayOut> result;
  WayOut base{options, ""};
  if (!options.normal.empty() && options.gradient != positive_walls) {
    base.options.gradient = positive_walls;
    base.words = "--gradient " + base.options.gradient;
    result.push_back(base);
    base.words += ' ';
  }
  for (const auto& [scheme, policy] :
       {std::pair{"laplacian-positive", "widen"}, std::pair{"laplacian-mixed-zoc", ""}}) {
    if (options.scheme == scheme || options.tolerance) continue;
    result.push_back(base);
    result.back().options.scheme = scheme;
    result.back().words += std::string("--scheme ") + scheme;
    if (*policy == '\0') continue;
    result.back().options.on_degenerate = policy;
    result.back().words += std::string(" --on-degenerate ") + policy;
  }
  return result;
}

/// Whether as many steps with these options go well.
bool goes_well(const DiffuseOptions& options, Machine& machine, Eigen::VectorXd u, int steps) {
  try {
    Report unread;
    const Diffusion heat = diffusion_again(options, machine, unread);
    GrowthWatch watch(machine, u, heat);
    for (int step = 1; step <= steps; ++step) {
      advance(options, heat, step, u);
      watch.look(field_after(options, step), u);
    }
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

/// The first way out that goes well for as many steps, "; " before it.
std::string advice(const DiffuseOptions& options, Machine& machine, const Eigen::VectorXd& start,
                   int steps) {
  if (!machine.keeps_neighbours()) return "";
  for (const WayOut& way : ways_out(options))
    if (goes_well(way.options, machine, start, steps))
      return "; with " + way.words + " it does not (tried)";
  return "";
}

}  // namespace

Steps make_steps(const DiffuseOptions& options, Machine& machine, const Diffusion& heat,
                 const Eigen::VectorXd& start, Eigen::VectorXd& u,
                 const std::function<void(int)>& done) {
  u = start;
  Steps steps{options.steady ? 1 : *options.steps};
  GrowthWatch watch(machine, u, heat);
  std::optional<Progress> progress;
  if (machine.is_first()) progress.emplace("steps");
  for (int step = 1; step <= steps.count; ++step) {
    try {
      const SolveReport report = advance(options, heat, step, u);
      steps.total.residual = std::max(steps.total.residual, report.residual);
      steps.total.iterations += report.iterations;
      steps.total.seconds += report.seconds;
      watch.look(field_after(options, step), u);
    } catch (const SolverError& error) {
      if (options.steady) throw;
      throw std::runtime_error("step " + std::to_string(step) + ": " + error.what());
    } catch (const Growth& growth) {
      throw std::runtime_error(growth.what() + advice(options, machine, start, step));
    }
    done(step);
    steps.convergence = *heat.convergence;
    if (progress) progress->show(step, steps.count);
  }
  return steps;
}

namespace {

std::ostream& operator<<(std::ostream& out, const Range& range) {
  return out << '[' << range.least << ", " << range.most << ']';
}

/// Whether the field has left its range by more than rounding.
bool left(const Range& before, const Range& after) {
  const double margin = 0.01 * (before.most - before.least) +
                        1e-9 * std::max(std::abs(before.least), std::abs(before.most));
  return after.least < before.least - margin || after.most > before.most + margin;
}

/// Whether the field stays within its range with --damped-start, in the steps in which it would leave it most.
bool damping_helps(DiffuseOptions options, Machine& machine, const Diffusion& heat,
                   Eigen::VectorXd u) {
  constexpr int tried = 20;
  options.damped_start = true;
  const Range before = lawful_range(machine, u, heat);
  for (int step = 1; step <= std::min(tried, *options.steps); ++step) {
    advance(options, heat, step, u);
    if (left(before, range(machine, u))) return false;
  }
  return true;
}

}  // namespace

std::string range_note(const DiffuseOptions& options, Machine& machine, const Diffusion& heat,
                       const Eigen::VectorXd& start, const Range& after) {
  const Range before = lawful_range(machine, start, heat);
  if (heat.drift != 0 || !left(before, after)) return "";
  const std::string law = "  diffusion alone never leaves the range it started from: ";
  if (options.steady || options.theta == 1)
    return law +
           "on these points the scheme, or that of\n  the walls' gradient, does not approximate "
           "it\n";
  const bool damping = !options.damped_start && damping_helps(options, machine, heat, start);
  return law + "Crank-Nicolson overshoots from jumps at this\n  step; " +
         (damping ? "with --damped-start it does not (tried), nor does --theta 1"
                  : "--theta 1 does not") +
         ", nor do steps up to " + text(heat.gentle_step) + " where\n  no weight is negative\n";
}

void print_solution(const DiffuseOptions& options, const SolverReport& solver, const Steps& steps,
                    const Range& before, const Range& after, const std::string& note) {
  std::cout << "solved by " << solver.description << ":\n  " << solver.reason << '\n'
            << (options.steady ? "steady" : "steps: " + std::to_string(steps.count)) << ", "
            << (solver.iterates ? "iterations: " : "refinements: ") << steps.total.iterations
            << ", largest relative residual " << text(steps.total.residual) << '\n'
            << options.field << " was in " << before << ", is in " << after << '\n'
            << note;
}

}  // namespace gradpsi::apps
