#pragma once

#include <filesystem>
#include <string>

// The files that a study leaves in a folder.

namespace gradpsi::apps {

/// Creates the folder if need be.
void create_folder(const std::filesystem::path& folder);

/// What the names of files end with: nothing for the usual dimension, else "_2d".
std::string dimension_suffix(int dimension, int usual);

/// "# key: value" lines on how numbers came about.
std::string provenance(int threads);

}  // namespace gradpsi::apps
