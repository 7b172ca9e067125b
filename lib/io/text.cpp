#include "io/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "gradpsi/error.hpp"

namespace gradpsi {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  for (line = trimmed(line); !line.empty();) {
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    result.push_back(line.substr(0, end));
    line = trimmed(line.substr(end));
  }
  return result;
}

bool is_text(std::string_view text) {
  int following = 0;
  for (const unsigned char c : text) {
    if (following > 0 ? (c & 0xC0) != 0x80
                      : (c < 0x20 && c != '\t') || c == 0x7F || (c & 0xC0) == 0x80 || c > 0xF7)
      return false;
    following = following > 0 ? following - 1 : c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : c >= 0xC0 ? 1 : 0;
  }
  return following == 0;
}

std::string excerpt(std::string_view text) {
  std::string shown(text.substr(0, 40));
  std::ranges::replace_if(
      shown, [](unsigned char c) { return c < 0x20 || c > 0x7E; }, '?');
  return shown + (text.size() > 40 ? "..." : "");
}

double number(std::string_view word, const std::string& place) {
  double x;
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(x))
    throw InvalidInput(place + "'" + excerpt(word) + "' is not a finite number");
  return x;
}

int whole_number(std::string_view word, int least, int most, const std::string& place) {
  int n = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), n);
  if (error != std::errc() || end != word.data() + word.size() || n < least || n > most)
    throw InvalidInput(place + "'" + excerpt(word) + "' is not a whole number from " +
                       std::to_string(least) + " to " + std::to_string(most));
  return n;
}

}  // namespace gradpsi
