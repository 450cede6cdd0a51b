#pragma once
#include <string>
#include <string_view>

namespace app {

/// Text of others, fit for a one-line message: control characters become spaces, at most `longest` bytes.
[[nodiscard]] std::string one_line(std::string_view text, std::size_t longest = 200);

}  // namespace app
