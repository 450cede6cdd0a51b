#pragma once
#include <string>
#include <vector>

namespace app {

/// The parts between the commas, one more than there are commas.
[[nodiscard]] std::vector<std::string> split_at_commas(const std::string& text);

}  // namespace app
