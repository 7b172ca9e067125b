#include "common/columns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace gradpsi::apps {

std::string cell(double x, const char* format) {
  if (!std::isfinite(x)) return {};
  std::array<char, 40> digits;
  std::snprintf(digits.data(), digits.size(), format, x);
  return digits.data();
}

std::string padded(const std::string& text, int width) {
  const std::string spaces(std::max(0, std::abs(width) - static_cast<int>(text.size())), ' ');
  return width < 0 ? text + spaces : spaces + text;
}

}  // namespace gradpsi::apps
