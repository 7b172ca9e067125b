#pragma once

#include <string>

#include "studies/findings.hpp"

// What an operator is fit for, in words and in numbers.

namespace gradpsi::apps {

/// Of derivatives.
std::string on_derivatives(const Findings& findings, const RowReport& rows);
/// Of a Laplacian.
std::string on_explicit_steps(const Problem& problem, const Findings& findings);
std::string on_implicit_steps(const Findings& findings);

/// For the report.
Inspection inspection(const Problem& problem, const Findings& findings);

}  // namespace gradpsi::apps
