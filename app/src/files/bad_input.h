#pragma once
#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// Bad usage or bad input: the program prints what() as its one line on standard error and ends with
/// status 2. The text: [FILE[:LINE:COLUMN]: ]error: found ..., expected ...; what to do. Control characters in it, of what was
/// found, become spaces.
class BadInput : public std::runtime_error {
public:
    explicit BadInput(std::string_view text);
};

/// Whether a character may stand in no one-line message.
[[nodiscard]] inline bool is_control(char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}
/// Text of others, fit for a one-line message: control characters become spaces, at most `longest` bytes.
[[nodiscard]] std::string one_line(std::string_view text, std::size_t longest = 200);

/// "1 strike", "2 strikes", "2 bodies".
[[nodiscard]] std::string counted(std::uint64_t count, std::string_view one);
[[nodiscard]] inline std::string counted(std::integral auto count, std::string_view one) {
    return counted(static_cast<std::uint64_t>(count), one);
}

/// "; the nearest is W", W the one of the words that takes the fewest letters put in, left out or exchanged to
/// become `word`; empty if that is more than a third of its letters and one.
[[nodiscard]] std::string nearest_hint(const std::string& word, const std::vector<std::string>& words);

}  // namespace app
