#pragma once

#include <memory>

#include "common/machine.hpp"

namespace gradpsi::apps {

/// The processes of PETSC_COMM_WORLD.
std::unique_ptr<Machine> several_processes();

}  // namespace gradpsi::apps
