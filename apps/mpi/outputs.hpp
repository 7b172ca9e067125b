#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/operators.hpp"
#include "mpi/given.hpp"

// Tables of which each process has the rows that it has read.

namespace gradpsi::apps {

/// All files that are written for this one: beside a .pvtu a piece a process, OUT_rank0.vtu and so on.
std::vector<std::filesystem::path> parts_of(const std::filesystem::path& file);

/// One file with the rows of all processes, by rank, written by the first.
void write_csv_together(const std::filesystem::path& file, const Table& part);

/// A .pvtu and its pieces.
void write_pieces(const OperatorOptions& options, const std::filesystem::path& file,
                  const Table& part);

/// The picture, from some of all processes' points.
/// @return  whether there is one; false in all processes but the first
bool draw_together(const std::filesystem::path& picture, const Given& given, const Table& part,
                   const std::string& name, const std::string& title);

}  // namespace gradpsi::apps
