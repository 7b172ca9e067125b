#pragma once

#include <filesystem>
#include <gradpsi/error.hpp>

#include "common/operators.hpp"

// Probes: where `derive --at` has values and derivatives, rather than at the points.

namespace gradpsi::apps {

/// A file of probes with the operator there, m x n: its table, and the operator's axes.
/// @param points  the points and their fields
/// @throws BadUsage  for options that are of the points' own rows alone
/// @throws InvalidInput  for a probe without a coordinate of the points', outside them, or off the line or
///   plane in which they lie
Problem at_probes(const OperatorOptions& options, const std::filesystem::path& probes,
                  const Problem& points, Report& report);

/// What the call returns; what is wrong with its input is said of this file.
template <class Call>
auto naming(const std::filesystem::path& file, const Call& call) {
  try {
    return call();
  } catch (const InvalidInput& error) {
    throw InvalidInput(file.string() + ": " + error.what());
  }
}

}  // namespace gradpsi::apps
