#pragma once

#include <vector>

#include "base/cpu.hpp"
#include "gradpsi/assemble.hpp"
#include "operators/pattern.hpp"
#include "operators/plan.hpp"

namespace gradpsi {

/// Computes the values of all requests, whose matrices have their pattern, and their row reports.
/// Without `cpu` every row by itself.
void fill(const Cpu* cpu, const std::vector<Request>& requests, const Cloud& cloud,
          const Neighbours& near, const DenseVector& volumes, const ChosenRows& rows,
          const AssemblyOptions& options);

}  // namespace gradpsi
