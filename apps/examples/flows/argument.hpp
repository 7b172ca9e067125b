#pragma once

#include <charconv>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

/// The number that a word of the command line stands for.
/// @throws std::invalid_argument  that says what was expected, if it stands for none or for less than `least`
template <class Number>
Number argument(const std::string& name, std::string_view word, Number least) {
  Number x{};
  const char* const end = word.data() + word.size();
  const auto [read, error] = std::from_chars(word.data(), end, x);
  if (error == std::errc() && read == end && x >= least) return x;
  std::ostringstream text;
  text << name << " must be a " << (Number(0.5) == 0 ? "whole " : "") << "number of at least "
       << least << ", not '" << word << "'";
  throw std::invalid_argument(text.str());
}
