#pragma once

#include <filesystem>
#include <string>

namespace gradpsi::apps {

/// Writes the script to `file` and has gnuplot draw the tables of that folder; the figures take their place
/// there when all are complete.
/// @throws std::runtime_error  if gnuplot fails or is not there; the message names `data`, which is
///   complete; if a figure cannot be written
void draw(const std::filesystem::path& file, const std::string& script,
          const std::filesystem::path& data);

}  // namespace gradpsi::apps
