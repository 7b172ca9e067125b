#pragma once

#include "common/cli.hpp"

namespace gradpsi::apps {

// The commands of gradpsi-mpi: so far one.
std::function<void()> declare_mpi_diffuse(Options& options);

}  // namespace gradpsi::apps
