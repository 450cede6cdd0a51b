#include "files/fields.h"

#include <fmt/format.h>

#include <array>

namespace app {

const KeyTypeText& text_of(KeyType type) {
    static constexpr KeyTypeText kText = {"a text in quotes", "text", "{2}"};
    static constexpr std::array<KeyTypeText, 9> kTexts = {{
        kText,
        kText,  // a choice lists its words
        {"true or false", "true or false", R"("type": "boolean")"},
        {"a number from {0} to {1}", "number", R"("type": "number", "minimum": {0}, "maximum": {1})"},
        {"a number from {0} to {1} or a fraction such as \"1/60\"", "number, or fraction in quotes",
         R"("anyOf": [{{"type": "number", "minimum": {0}, "maximum": {1}}}, )"
         R"({{"type": "string", "pattern": "^[0-9.eE+-]+(/[0-9.eE+-]+)?$"}}])"},
        {"a whole number from {0} to {1}", "whole number",
         R"("type": "integer", "minimum": {0}, "maximum": {1})"},
        {"an array of texts", "array of texts", R"("type": "array", "items": {{{2}}})"},
        {"an array of texts", "text, or array of texts",
         R"("anyOf": [{{{2}}}, {{"type": "array", "items": {{{2}}}}}])"},
        {"a table", "texts by name",
         R"("type": "object", "additionalProperties": {{"anyOf": [{{"type": "string"}}, )"
         R"({{"type": "object", "additionalProperties": {{"type": "string"}}}}]}})"},
    }};
    static_assert(kTexts.size() == static_cast<std::size_t>(KeyType::columns) + 1);
    return kTexts[static_cast<std::size_t>(type)];
}

void Fields::require_direction(const Eigen::Vector3d& value, std::string_view key) const {
    require(value.norm() >= 1e-6, key, fmt::format("{} = [0, 0, 0]", key), "a direction");
}

std::string range_text(double low, double high) {
    return fmt::format("a number from {} to {}", low, high);
}

}  // namespace app
