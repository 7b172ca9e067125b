#pragma once

#include <string>
#include <vector>

#include "studies/converge.hpp"

namespace gradpsi::apps::converge {

/// Fitted orders of every scheme and, claim by claim, whether the paper's conclusions were observed; for people.
std::string summary(const std::vector<Result>& results, int dimension);

}  // namespace gradpsi::apps::converge
