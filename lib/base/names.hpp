#pragma once

#include <array>
#include <string_view>

namespace gradpsi {

/// How the values of an enumeration are spelt, in the order of their declaration.
template <std::size_t count, class Enum>
constexpr std::string_view spelling(const std::array<std::string_view, count>& names, Enum e) {
  return names.at(static_cast<std::size_t>(e));
}

}  // namespace gradpsi
