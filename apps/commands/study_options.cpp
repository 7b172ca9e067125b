#include "commands/study_options.hpp"

namespace gradpsi::apps {

void StudyOptions::declare(Options& options, const std::string& domain,
                           const std::string& quick_means, const std::string& threads_mean) {
  options.file("--out", out, "DIR", "Folder for the results");
  options.count("--dimension", dimension, {1, 3}, "D", "Of the " + domain);
  options.flag("--quick", quick, quick_means);
  options.count("--threads", threads, thread_limits, "N", threads_mean);
}

}  // namespace gradpsi::apps
