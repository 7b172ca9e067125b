#include "common/remedy.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gradpsi/assemble.hpp>
#include <gradpsi/error.hpp>
#include <numeric>

#include "common/anisotropy.hpp"
#include "common/median.hpp"
#include "common/principal.hpp"

namespace gradpsi::apps {

namespace {

constexpr std::size_t most_tried = 1000;

/// The rows of these points that are degenerate.
std::vector<int> degenerate(const Scheme& scheme, const Problem& problem, AssemblyOptions assembly,
                            std::vector<int> points) {
  assembly.on_degenerate = OnDegenerate::Zero;
  if (points.empty()) {
    points.resize(problem.cloud.size());
    std::iota(points.begin(), points.end(), 0);
  }
  assembly.rows = points;
  const Operator op = gradpsi::assemble(scheme, problem.cloud, problem.near, assembly);
  std::vector<int> result;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (op.rows.outcome[k] == RowOutcome::Zero) result.push_back(points[k]);
  return result;
}

/// Up to `most_tried` of them, evenly.
std::vector<int> some_of(const std::vector<int>& points) {
  if (points.size() <= most_tried) return points;
  std::vector<int> result(most_tried);
  for (std::size_t k = 0; k < most_tried; ++k) result[k] = points[k * points.size() / most_tried];
  return result;
}

/// The shortest extent of points over the longest, as their covariance has it.
double thickness(const Eigen::MatrixXd& x) {
  const Eigen::MatrixXd centred = x.rowwise() - x.colwise().mean();
  const Eigen::VectorXd squares = principal_axes(centred.transpose() * centred).values;
  return std::sqrt(std::max(0.0, squares[0]) / squares[squares.size() - 1]);
}

/// Whether points with at least three neighbours have them on a line or surface, or close to one.
bool on_a_surface(const Problem& problem, const std::vector<int>& points) {
  std::vector<double> found;
  for (const int i : points) {
    std::vector<int> near(problem.near.of(i).begin(), problem.near.of(i).end());
    near.push_back(i);
    if (std::ssize(near) > problem.cloud.dimension() + 1)
      found.push_back(thickness(problem.cloud.positions()(near, Eigen::all)));
  }
  return found.size() > points.size() / 2 && median(found) < 0.2;
}

/// How many of the rows a policy computes, with supports that much larger.
std::ptrdiff_t computed(const Scheme& scheme, const Problem& problem, AssemblyOptions assembly,
                        const std::vector<int>& points, OnDegenerate policy, double factor) {
  assembly.on_degenerate = policy;
  assembly.rows = points;
  const Eigen::VectorXd larger = factor * problem.near.supports;
  try {
    const Neighbours near =
        factor == 1 ? problem.near
                    : gradpsi::find_neighbours(problem.cloud, larger, points, assembly.threads);
    const Operator op = gradpsi::assemble(scheme, problem.cloud, near, assembly);
    return std::ssize(points) - std::ranges::count(op.rows.outcome, RowOutcome::Zero);
  } catch (const InvalidInput&) {  // more than half the box, more entries than there can be
    return 0;
  }
}

/// What of the points' own shape stands in the way, which no support and no policy can help; "": nothing.
std::string flatness(const Scheme& scheme, const Problem& problem, const AssemblyOptions& assembly,
                     const std::vector<int>& points) {
  const Cloud& cloud = problem.cloud;
  if (cloud.dimension() == 1) return "";
  const bool plane = cloud.dimension() == 2;
  if (const double extent = thickness(cloud.positions()); extent < 1e-6)
    return std::string("the points lie in a ") + (plane ? "line" : "plane or line") + " up to " +
           text(extent) + " of their extent: no derivative across it can be told from them. Give " +
           "their coordinates within it";
  if (assembly.on_surface || !on_a_surface(problem, points)) return "";
  AssemblyOptions within = assembly;
  within.on_surface = true;
  const auto found = computed(scheme, problem, within, points, assembly.on_degenerate, 1);
  return std::string("their neighbours lie on a ") + (plane ? "line" : "surface") +
         ", across which no derivative can be told from them: " +
         (found == std::ssize(points)
              ? "--on-surface computes those within it"
              : "no support and no policy helps in " + std::to_string(cloud.dimension()) + "D");
}

/// x with two digits, or a bit more than it.
double rounded_up(double x) {
  const double unit = std::pow(10, std::floor(std::log10(x)) - 1);
  return std::ceil(x / unit * (1 - 1e-9)) * unit;
}

/// One support for all that reaches across the largest of spacings that differ by direction, and computes all
/// rows; 0: there is none.
double support_across(const Problem& problem, int threads,
                      const std::function<bool(double factor)>& computes_all) {
  if (problem.near.supports.size() != 1) return 0;
  const auto found = anisotropy(problem.cloud, problem.near, threads);
  if (!found) return 0;
  for (const double spacings : {2.5, 3.5, 5.0})
    if (const double support = rounded_up(spacings * found->largest);
        computes_all(support / problem.near.supports[0]))
      return support;
  return 0;
}

}  // namespace

std::string remedy(const Scheme& scheme, const Problem& problem, AssemblyOptions assembly,
                   std::vector<int> points) {
  points = some_of(degenerate(scheme, problem, assembly, std::move(points)));
  if (points.empty()) return "";
  const auto computes = [&](OnDegenerate policy, double factor) {
    return computed(scheme, problem, assembly, points, policy, factor);
  };
  const auto computes_all = [&](double factor) {
    return computes(OnDegenerate::Zero, factor) == std::ssize(points);
  };
  const bool widened = assembly.on_degenerate == OnDegenerate::Widen;
  const auto by_widening = widened ? 0 : computes(OnDegenerate::Widen, 1);
  if (by_widening == std::ssize(points)) return "; --on-degenerate widen computes them";
  if (const double support = support_across(problem, assembly.threads, computes_all); support > 0)
    return "; --support " + text(support) +
           ", which reaches across the largest spacings, computes them";
  if (const std::string why = flatness(scheme, problem, assembly, points); !why.empty())
    return "; " + why;
  const std::string tried = by_widening == 0
                                ? ""
                                : " (--on-degenerate widen " + std::to_string(by_widening) +
                                      " of " + std::to_string(points.size()) + ")";
  for (const double factor : {1.25, 1.5, 2.0, 3.0})
    if (computes_all(factor))
      return "; a support " + text(factor) + " times as large computes them" + tried;
  if (assembly.on_degenerate != OnDegenerate::Lower &&
      computes(OnDegenerate::Lower, 1) == std::ssize(points))
    return "; --on-degenerate lower computes them" + tried;
  return "; neither a larger support nor --on-degenerate computes all of them" + tried;
}

}  // namespace gradpsi::apps
