#pragma once

#include <filesystem>
#include <string>

#include "common/cli.hpp"

namespace gradpsi::apps {

/// The options of a study, which writes CSV files into a folder and has gnuplot draw them.
struct StudyOptions {
  std::filesystem::path out = ".";
  int dimension;
  bool quick = false;
  int threads;

  void declare(Options& options, const std::string& domain, const std::string& quick_means,
               const std::string& threads_mean);
};

}  // namespace gradpsi::apps
