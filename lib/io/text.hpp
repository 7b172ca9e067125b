#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gradpsi {

/// Without blanks at either end.
std::string_view trimmed(std::string_view text);

/// The words of a line, which blanks part.
std::vector<std::string_view> words(std::string_view line);

/// Whether text is UTF-8 without control characters: what XML and terminals can take.
bool is_text(std::string_view text);

/// At most so much of a cell in a message that it stays readable.
std::string excerpt(std::string_view text);

/// The finite number that a word is.
/// @throws InvalidInput  beginning with `place`
double number(std::string_view word, const std::string& place);
int whole_number(std::string_view word, int least, int most, const std::string& place);

}  // namespace gradpsi
