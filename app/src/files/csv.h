#pragma once
#include <string>
#include <string_view>

namespace app {

/// A name as a field of a CSV row: quoted where it must be (RFC 4180).
[[nodiscard]] std::string csv_field(std::string_view text);

}  // namespace app
