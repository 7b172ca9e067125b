#include "common/growth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/steps.hpp"

namespace gradpsi::apps {

namespace {

constexpr double factor = 30;  // see GrowthWatch
constexpr double part_of_size = 1e-3;

double most_of_all(const Machine& machine, const Eigen::VectorXd& values) {
  return machine.largest(values.size() > 0 ? values.maxCoeff() : 0);
}

}  // namespace

GrowthWatch::GrowthWatch(const Machine& machine, const Eigen::VectorXd& u, const Diffusion& heat)
    : machine_(machine), before_(lawful_range(machine, u, heat)), drift_(heat.drift), last_(u) {
  slack_ = part_of_size * std::max(std::abs(before_.least), std::abs(before_.most));
}

void GrowthWatch::look(const std::string& field, const Eigen::VectorXd& u) {
  const Eigen::VectorXd beyond = (u.array() - before_.most).max(before_.least - u.array());
  const Eigen::VectorXd change = (u - last_).cwiseAbs();
  last_ = u;
  ++steps_;
  if (const double limit = factor * (before_.most - before_.least + steps_ * drift_) + slack_;
      !(most_of_all(machine_, beyond) <= limit))
    refuse(field, beyond, u);
  const double most = most_of_all(machine_, change);
  if (steps_ == 1) first_change_ = most;
  if (!(most <= factor * first_change_ + slack_)) refuse(field, change, u);
}

/// Names the point where `much` is most.
void GrowthWatch::refuse(const std::string& field, const Eigen::VectorXd& much,
                         const Eigen::VectorXd& u) const {
  constexpr double nobody = std::numeric_limits<double>::max();
  Eigen::Index place = 0;
  const bool mine = much.size() > 0 && much.maxCoeff(&place) == most_of_all(machine_, much);
  const double number =
      mine ? static_cast<double>(machine_.cloud().number(static_cast<int>(place))) : nobody;
  const double point = machine_.least(number);
  const double value = machine_.largest(number == point ? u[place] : -nobody);
  throw Growth(field + " is " + text(value) + " at point " + text(point) + ", and was within [" +
               text(before_.least) + ", " + text(before_.most) +
               "]: diffusion with these sources and walls does not grow like that, the scheme on "
               "these points does, or its rows at walls");
}

}  // namespace gradpsi::apps
