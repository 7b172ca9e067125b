#pragma once

#include <gradpsi/petsc.hpp>

#include "common/report.hpp"

namespace gradpsi::apps {

/// Reports an operator of all processes' points.
void describe_together(const Operator& op, const petsc::Subdomain& mine, const Neighbours& near,
                       Report& report);

}  // namespace gradpsi::apps
