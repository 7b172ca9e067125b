#pragma once

#include <CLI/CLI.hpp>

namespace gradpsi::apps {

// One source file per subcommand; each adds itself with its options and what it does.
void add_schemes(CLI::App& app);
void add_assemble(CLI::App& app);
void add_derive(CLI::App& app);
void add_diffuse(CLI::App& app);
void add_inspect(CLI::App& app);
void add_converge(CLI::App& app);
void add_stability(CLI::App& app);
void add_tradeoff(CLI::App& app);
void add_advise(CLI::App& app);
void add_spmv(CLI::App& app);
void add_manual(CLI::App& app);

}  // namespace gradpsi::apps
