#pragma once

#include <CLI/CLI.hpp>

// The subcommands of gradpsi-mpi: so far one.
void add_mpi_diffuse(CLI::App& app);
