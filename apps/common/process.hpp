#pragma once

namespace gradpsi::apps {

/// What main() begins with: a closed pipe or a limit on sizes becomes a failed write, and no threads run or
/// start but those that are asked for.
void prepare_process();

}  // namespace gradpsi::apps
