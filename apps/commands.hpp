#pragma once

#include "common/cli.hpp"

namespace gradpsi::apps {

// One source file per command: its options, and what it does with them.
std::function<void()> declare_schemes(Options& options);
std::function<void()> declare_assemble(Options& options);
std::function<void()> declare_derive(Options& options);
std::function<void()> declare_diffuse(Options& options);
std::function<void()> declare_inspect(Options& options);
std::function<void()> declare_converge(Options& options);
std::function<void()> declare_stability(Options& options);
std::function<void()> declare_tradeoff(Options& options);
std::function<void()> declare_advise(Options& options);
std::function<void()> declare_spmv(Options& options);
std::function<void()> declare_manual(Options& options);

/// The table of them.
std::span<const Command> commands();

}  // namespace gradpsi::apps
