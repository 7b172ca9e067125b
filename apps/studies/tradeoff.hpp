#pragma once

#include "common/study.hpp"

namespace gradpsi::apps {

/// Measures, writes tradeoff.csv, its fronts and a summary, and draws.
void tradeoff(const StudyOptions& options);

}  // namespace gradpsi::apps
