#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/points.hpp"
#include "studies/candidates.hpp"

// What `gradpsi advise` is asked, and what it says.

namespace gradpsi::apps::candidates {

struct AdviseOptions : PointOptions {
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
  Derivative which() const {
    return derivative == "laplacian" ? Derivative::Laplacian : Derivative::Gradient;
  }
};

/// The command line that uses the candidate on these points.
std::string command_line(const AdviseOptions& options, const Points& points, const Candidate& c);

/// What to take, with the command line that does, or why there is nothing.
/// @param chosen   null: none
/// @param command  the command line for the chosen one
std::string advice(const Trial& trial, std::vector<Candidate>& all, const Candidate* chosen,
                   const std::string& command);

/// All candidates in the order of their cost.
std::string table(const Trial& trial, const std::vector<Candidate>& all, const Candidate* chosen);

/// The same choice from all rows of all candidates, and what the sample's choice costs more.
std::string comparison(const Trial& trial, const Candidate* chosen, Timer& timer);

}  // namespace gradpsi::apps::candidates
