#pragma once

#include <CLI/CLI.hpp>

namespace gradpsi::apps {

// The subcommands of gradpsi-mpi: so far one.
void add_mpi_diffuse(CLI::App& app);

}  // namespace gradpsi::apps
