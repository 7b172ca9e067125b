#pragma once

#include <string>
#include <vector>

#include "common/operators.hpp"

namespace gradpsi::apps {

/// What can be done about rows that cannot be computed, "; " before it: what has been tried on them, up to a
/// thousand, and helps, or why nothing does.
/// @param assembly  as they were assembled in vain; the policy counts
/// @param points    theirs, or others among them; empty: all
std::string remedy(const Scheme& scheme, const Problem& problem, AssemblyOptions assembly,
                   std::vector<int> points = {});

}  // namespace gradpsi::apps
