#pragma once

#include <memory>

#include "common/machine.hpp"

namespace gradpsi::apps {

/// A program that has the command `diffuse`.
struct DiffuseProgram {
  const char* call;    ///< how it is called
  const char* output;  ///< what it makes of -o
  std::unique_ptr<Machine> (*machine)();
};

/// The command of either program: its options, and what it does with them.
std::function<void()> declare_diffuse(Options& options, const DiffuseProgram& program);

}  // namespace gradpsi::apps
