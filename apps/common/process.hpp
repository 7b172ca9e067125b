#pragma once

namespace gradpsi::apps {

/// What main() begins with: a closed pipe or a limit on sizes becomes a failed write, and threads that
/// nobody needs yet are sent home.
void prepare_process();

}  // namespace gradpsi::apps
