#pragma once

#include <vector>

#include "base/cpu.hpp"
#include "gradpsi/assemble.hpp"

namespace gradpsi {

/// assemble() with that vector code. Null: every row by itself, which is slow and the reference.
/// @param volumes  n numbers, 0 for what is no point but has a row; empty: those that assemble() takes
std::vector<Operator> assemble_with(const Cpu* cpu, const std::vector<Scheme>& schemes,
                                    const Cloud& cloud, const Neighbours& near,
                                    const AssemblyOptions& options,
                                    const DenseVector& volumes = {});

}  // namespace gradpsi
