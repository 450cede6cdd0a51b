#pragma once
#include <string>

namespace app {

/// What `musicworld --version` prints: "musicworld 0.1.0", then a line for the build and one for the libraries.
[[nodiscard]] std::string version_text();

}  // namespace app
