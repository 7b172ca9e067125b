#pragma once

#include "common/study.hpp"

namespace gradpsi::apps {

/// Measures, writes stability.csv, the cases looked at closely and a summary, and draws.
void stability(const StudyOptions& options);

}  // namespace gradpsi::apps
