#pragma once
#include <string>

namespace app {

/// The style sheet of report.html: follows the reader's choice of light or dark, prints on white.
[[nodiscard]] std::string report_style();

}  // namespace app
