#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace app {

using nlohmann::json;

/// Follows a $ref into the schema's definitions.
inline const json& resolved(const json& root, const json& node) {
    return node.contains("$ref") ? root.at(json::json_pointer(node["$ref"].get<std::string>().substr(1)))
                                 : node;
}

inline std::string toml_of(const json& value) {
    std::string text;
    if (value.is_object()) {
        for (const auto& [key, inner] : value.items())
            text += (text.empty() ? "" : ", ") + ('"' + key + "\" = " + toml_of(inner));
        return "{ " + text + " }";
    }
    if (value.is_array()) {
        for (const json& inner : value) text += (text.empty() ? "" : ", ") + toml_of(inner);
        return "[" + text + "]";
    }
    return value.dump();
}

/// A value with every key of an object's schema at its example.
inline json example_of(const json& root, const json& node_or_ref) {
    const json& node = resolved(root, node_or_ref);
    if (node.contains("examples")) return node["examples"][0];
    if (node["type"] == "array") return json::array({example_of(root, node["items"])});
    json value = json::object();
    for (const auto& [key, inner] : node["properties"].items()) value[key] = example_of(root, inner);
    return value;
}

inline std::string toml_text(const json& file) {
    std::string text;
    for (const auto& [key, value] : file.items()) text += key + " = " + toml_of(value) + "\n";
    return text;
}

/// Visits every object of the schema that holds named keys, with the place of such an object in a file:
/// the first of an array, the one named by the first example where names are free.
template <class Visit>
void for_each_table(const json& root, const json& node_or_ref, const json::json_pointer& place,
                    const Visit& visit) {
    const json& node = resolved(root, node_or_ref);
    if (node["type"] == "array" && node["items"].contains("$ref"))
        for_each_table(root, node["items"], place / 0, visit);
    if (node.contains("additionalProperties") && node["additionalProperties"].contains("$ref"))
        for_each_table(root, node["additionalProperties"], place / node["examples"][0].begin().key(), visit);
    if (!node.contains("properties")) return;
    visit(node, place);
    for (const auto& [key, inner] : node["properties"].items())
        for_each_table(root, inner, place / key, visit);
}

}  // namespace app
