#pragma once
#include <set>
#include <string>
#include <string_view>

namespace tracking {

/// A stick's name as native files can hold it: printable, at most 64 bytes, '_' for blanks, commas and
/// quotes.
[[nodiscard]] std::string stick_word(std::string_view name);

/// `name`; where it is empty or taken, the first of `substitute` and `number`, or the numbers after it, that
/// is not. Then that is taken, too.
[[nodiscard]] std::string unique_name(std::string name, const std::string& substitute, std::size_t number,
                                      std::set<std::string>& taken);

}  // namespace tracking
