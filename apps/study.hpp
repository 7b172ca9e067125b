#pragma once

#include <filesystem>
#include <string>

// What the studies share: each writes CSV files into a folder and has gnuplot draw them.

/// Creates the folder if need be.
void create_folder(const std::filesystem::path& folder);

/// "# key: value" lines on how numbers came about.
std::string provenance(int threads);

/// Finite numbers as text, others as nothing.
std::string cell(double x, const char* format = "%.9g");

/// Text filled up with spaces on the left.
std::string padded(const std::string& text, int width);

/// Writes the script to `file` and runs gnuplot on it in that folder.
/// @throws std::runtime_error  if gnuplot fails or is not there; the message names `data`, which is complete
void draw(const std::filesystem::path& file, const std::string& script,
          const std::filesystem::path& data);
