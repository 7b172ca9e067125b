#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

#include "common/steps.hpp"

namespace gradpsi::apps {

/// A field that has grown as no diffusion does.
struct Growth : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Looks at a field after each step.
///
/// Two laws of diffusion are asked to hold, up to a factor of 30 and a thousandth of the field's size. The field
/// leaves its range by no more than what sources and walls add. And, since these do not change, what a step
/// changes is diffused in its turn: no step changes the field by more than the first one. Stable matrices keep both
/// up to 2 mostly, 12 at most (ls-6 by Crank-Nicolson, of 1,700 matrices of irregular squares); Crank-Nicolson in
/// 1D up to 4.33 (I. Farago and C. Palencia, Appl. Numer. Math. 42, 2002). Growing modes go beyond any factor.
class GrowthWatch {
 public:
  GrowthWatch(const Machine& machine, const Eigen::VectorXd& u, const Diffusion& heat);
  /// @param field  what it is called in messages
  /// @throws Growth  in all processes
  void look(const std::string& field, const Eigen::VectorXd& u);

 private:
  void refuse(const std::string& field, const Eigen::VectorXd& much,
              const Eigen::VectorXd& u) const;

  const Machine& machine_;
  Range before_;
  double slack_, drift_, first_change_ = 0;
  Eigen::VectorXd last_;
  int steps_ = 0;
};

}  // namespace gradpsi::apps
