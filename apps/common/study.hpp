#pragma once

#include <filesystem>
#include <string>

#include "common/cli.hpp"

namespace gradpsi::apps {

// What the studies share: each writes CSV files into a folder and has gnuplot draw them.

/// The options that studies share.
struct StudyOptions {
  std::filesystem::path out = ".";
  int dimension;
  bool quick = false;
  int threads;

  void declare(Options& options, const std::string& domain, const std::string& quick_means,
               const std::string& threads_mean);
};

/// Creates the folder if need be.
void create_folder(const std::filesystem::path& folder);

/// "# key: value" lines on how numbers came about.
std::string provenance(int threads);

/// Finite numbers as text, others as nothing.
std::string cell(double x, const char* format = "%.9g");

/// Text filled up with spaces on the left.
std::string padded(const std::string& text, int width);

/// Writes the script to `file` and has gnuplot draw the tables of that folder; the figures take their place
/// there when all are complete.
/// @throws std::runtime_error  if gnuplot fails or is not there; the message names `data`, which is
///   complete; if a figure cannot be written
void draw(const std::filesystem::path& file, const std::string& script,
          const std::filesystem::path& data);

}  // namespace gradpsi::apps
