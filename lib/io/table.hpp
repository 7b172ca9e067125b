#pragma once

#include <array>
#include <string_view>

namespace gradpsi {

/// The columns that hold positions.
constexpr std::array<std::string_view, 3> axis_names = {"x", "y", "z"};

}  // namespace gradpsi
