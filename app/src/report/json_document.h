#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace app {

/// A JSON document as every file and command of ours writes it: indented, a line's end behind it. File names are
/// bytes: what is not UTF-8 in them becomes U+FFFD.
[[nodiscard]] std::string json_document(const nlohmann::ordered_json& json);

}  // namespace app
