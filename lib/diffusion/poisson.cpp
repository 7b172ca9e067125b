#include "gradpsi/poisson.hpp"

#include <limits>
#include <string>
#include <utility>

#include "gradpsi/error.hpp"

namespace gradpsi {
namespace {

DiffusionOptions steady(SolverOptions solver) {
  if (!solver.mean) solver.mean = 0;
  return {.time_step = std::numeric_limits<double>::infinity(), .solver = std::move(solver)};
}

}  // namespace

Poisson::Poisson(const Cloud& cloud, const Operator& laplacian, BoundaryConditions conditions,
                 const SolverOptions& solver)
    : conditions_(std::move(conditions)), step_(cloud, laplacian, conditions_, steady(solver)) {}

SolveReport Poisson::solve(const VectorView& f, Eigen::Ref<Eigen::VectorXd> u) {
  if (f.size() != u.size())
    throw InvalidInput("f has " + std::to_string(f.size()) + " values, u " +
                       std::to_string(u.size()));
  step_.set_source(-f);
  return step_.step(u);
}

void Poisson::update(const Cloud& cloud, const Operator& laplacian) {
  if (!conditions_.walls.points.empty())
    throw InvalidInput("walls have another gradient on other points: give the conditions, too");
  update(cloud, laplacian, conditions_);
}

void Poisson::update(const Cloud& cloud, const Operator& laplacian, BoundaryConditions conditions) {
  step_.set_source(DenseVector());  // f of the points before, which may have been fewer
  step_.update(cloud, laplacian, conditions);
  conditions_ = std::move(conditions);
}

}  // namespace gradpsi
