#pragma once

#include <optional>
#include <string>

#include "common/operator_options.hpp"

namespace gradpsi::apps {

/// What is to be done with the derivative.
enum class Use { Derivative, Explicit, Implicit };

struct AdviseOptions : OperatorOptions {
  std::string derivative, use = "derivative", fixed;
  double tolerance = 0;
  std::optional<double> wavelength;
  int sample = 2000;
  bool check = false;

  Use what_for() const {
    return use == "derivative" ? Use::Derivative
           : use == "explicit" ? Use::Explicit
                               : Use::Implicit;
  }
  bool laplacian() const { return derivative == "laplacian"; }
};

/// Prints the scheme and support to take for these points, and the candidates.
void advise(const AdviseOptions& options);

}  // namespace gradpsi::apps
