#pragma once

#include "studies/findings.hpp"

namespace gradpsi::apps {

/// Prints what is known of the operator, for people.
void print(const Problem& problem, const Findings& findings, const Report& report);

}  // namespace gradpsi::apps
