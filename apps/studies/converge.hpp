#pragma once

#include <optional>

#include "common/study.hpp"

namespace gradpsi::apps {

struct ConvergeOptions : StudyOptions {
  std::optional<int> points_max = {};
};

/// Measures, writes convergence.csv and its summary, and draws.
void converge(const ConvergeOptions& options);

}  // namespace gradpsi::apps
