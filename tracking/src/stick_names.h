#pragma once
#include <string>
#include <string_view>

namespace tracking {

/// A stick's name as native files can hold it: printable, at most 64 bytes, '_' for blanks, commas and quotes.
[[nodiscard]] std::string stick_word(std::string_view name);

}  // namespace tracking
