#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/cli.hpp"

namespace gradpsi::apps {

/// The options of a study, which writes CSV files into a folder and has gnuplot draw them.
struct StudyOptions {
  std::filesystem::path out = ".";
  std::optional<int> dimension = {};
  bool quick = false;
  int threads;

  /// @param domain  what has that dimension, and which it is if none is given: "square or cube [2]"
  void declare(Options& options, const std::string& domain, const std::string& quick_means,
               const std::string& threads_mean);
};

}  // namespace gradpsi::apps
