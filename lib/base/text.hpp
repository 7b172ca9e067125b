#pragma once

#include <algorithm>
#include <charconv>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gradpsi/error.hpp"

namespace gradpsi {

/// The shortest decimal digits that give the same double again, whatever the locale.
inline std::string shortest(double x) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, x).ptr};
}

/// Three digits, whatever the locale, for what is measured rather than given.
inline std::string rounded(double x) {
  char digits[32];
  return {digits,
          std::to_chars(digits, digits + sizeof digits, x, std::chars_format::general, 3).ptr};
}

/// Levenshtein distance: the fewest insertions, deletions and replacements from a to b.
inline int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = std::exchange(row[0], static_cast<int>(i) + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Throws InvalidInput: `what` has no such name; the valid names follow, nearest spelling first.
[[noreturn]] inline void throw_unknown(std::string_view what, std::string_view name,
                                       std::vector<std::string> valid) {
  std::stable_sort(valid.begin(), valid.end(), [&](const auto& a, const auto& b) {
    return edit_distance(a, name) < edit_distance(b, name);
  });
  std::string message = "unknown " + std::string(what) + " '" + std::string(name) + "'; valid: ";
  for (const auto& v : valid) message += (&v == &valid.front() ? "" : ", ") + v;
  throw InvalidInput(message);
}

}  // namespace gradpsi
