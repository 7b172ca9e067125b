#pragma once

#include <string>
#include <vector>

#include "studies/candidates.hpp"

// What `gradpsi advise` says.

namespace gradpsi::apps::candidates {

/// What to take, with the command line that does, or why there is nothing.
/// @param chosen   null: none
/// @param command  for the chosen one
std::string advice(const Trial& trial, std::vector<Candidate>& all, const Candidate* chosen,
                   const std::string& command);

/// All candidates in the order of their cost.
std::string table(const Trial& trial, const std::vector<Candidate>& all, const Candidate* chosen);

/// The same choice from all rows of all candidates, and what the sample's choice costs more.
std::string comparison(const Trial& trial, const Candidate* chosen);

}  // namespace gradpsi::apps::candidates
