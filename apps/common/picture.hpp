#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <gradpsi/cloud.hpp>
#include <string>

namespace gradpsi::apps {

/// Draws a field at points with gnuplot: in 1D a curve, else dots coloured by value, seen along the
/// shortest side of 3D points. At most 200,000 points are drawn, evenly chosen.
/// @return  false if gnuplot failed or is not there; then there is no picture
bool draw_field(const std::filesystem::path& png, const gradpsi::Positions& x,
                const Eigen::VectorXd& field, const std::string& name, const std::string& title);

/// Whether a .png or .svg file ends as it should: gnuplot does not notice when a disk is full.
bool is_complete(const std::filesystem::path& picture);

}  // namespace gradpsi::apps
