#include "schema_walk.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

namespace app {
namespace {

using Place = json::json_pointer;
using VisitTable = std::function<void(const json& table, const Place& place)>;

std::string toml_of(const json& value) {
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

/// Visits every object of the schema that holds named keys, with the place of such an object in the full file:
/// the first of an array, the first of those whose names are free.
void visit_tables(const FormatCase& format, const json& node_or_ref, const Place& place,
                  const VisitTable& visit) {
    const json& node = resolved(format.schema, node_or_ref);
    if (node.contains("items") && node["items"].contains("$ref"))
        visit_tables(format, node["items"], place / 0, visit);
    if (node.contains("additionalProperties") && node["additionalProperties"].contains("$ref"))
        visit_tables(format, node["additionalProperties"], place / format.full[place].begin().key(), visit);
    if (!node.contains("properties")) return;
    visit(node, place);
    for (const auto& [key, inner] : node["properties"].items())
        visit_tables(format, inner, place / key, visit);
}

void for_each_table(const FormatCase& format, const VisitTable& visit) {
    visit_tables(format, format.schema, Place(), visit);
}

using VisitKey = std::function<void(const json& node, const Place& place, const std::string& key)>;

void for_each_value(const FormatCase& format, const VisitKey& visit) {
    for_each_table(format, [&](const json& table, const Place& place) {
        for (const auto& [key, node] : table["properties"].items())
            if (!node.contains("$ref") && !(node.contains("items") && node["items"].contains("$ref")) &&
                !(node.contains("additionalProperties") && node["additionalProperties"].contains("$ref")))
                visit(node, place, key);
    });
}

/// What the reader says to the full file with another value at a place.
std::string refusal_with(const FormatCase& format, const Place& place, const json& value) {
    json file = format.full;
    format.uncover(file, place);
    file[place] = value;
    return format.refusal(file);
}

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

const json& resolved(const json& root, const json& node) {
    return node.contains("$ref") ? root.at(Place(node["$ref"].get<std::string>().substr(1))) : node;
}

json example_of(const json& root, const json& node_or_ref) {
    const json& node = resolved(root, node_or_ref);
    if (node.contains("examples")) return node["examples"][0];
    if (node.contains("default")) return node["default"];
    if (node.contains("items")) {
        if (!node["items"].contains("$ref")) return json::array();
        return json::array({example_of(root, node["items"])});
    }
    json value = json::object();
    if (node.contains("properties"))
        for (const auto& [key, inner] : node["properties"].items()) value[key] = example_of(root, inner);
    else if (node.contains("additionalProperties"))
        value["one"] = example_of(root, node["additionalProperties"]);
    return value;
}

std::string toml_text(const json& file) {
    std::string text;
    for (const auto& [key, value] : file.items()) text += key + " = " + toml_of(value) + "\n";
    return text;
}

int expect_every_key_is_described(const FormatCase& format) {
    int keys = 0;
    for_each_table(format, [&](const json& table, const Place& place) {
        for (const auto& [key, inner] : table["properties"].items()) {
            EXPECT_GT(resolved(format.schema, inner).value("description", "").size(), 3u)
                << place << " " << key;
            ++keys;
        }
    });
    return keys;
}

int expect_unknown_keys_are_refused(const FormatCase& format, const std::vector<std::string>& own) {
    int tables = 0;
    for_each_table(format, [&](const json& table, const Place& place) {
        // In a table of free parameters only a value that is no number is wrong.
        const std::string refusal = refusal_with(format, place / "no_such_key", "text");
        EXPECT_TRUE(holds(refusal, "unknown key \"no_such_key\"")) << place << ": " << refusal;
        const std::string before = ", expected only ";
        const std::size_t at = refusal.find(before);
        ASSERT_NE(at, std::string::npos) << place << ": " << refusal;
        std::set<std::string> named, known;
        for (const auto& [key, node] : table["properties"].items()) named.insert(key);
        const std::size_t from = at + before.size();
        std::istringstream list(refusal.substr(from, refusal.rfind("; the nearest") - from));
        for (std::string key; std::getline(list >> std::ws, key, ',');) known.insert(key);
        if (place.to_string().starts_with("/defaults"))
            for (const std::string& key : own)
                if (!named.contains(key)) known.erase(key);
        if (table["additionalProperties"].is_boolean()) {
            EXPECT_EQ(named, known) << place;
        } else {
            EXPECT_TRUE(std::includes(known.begin(), known.end(), named.begin(), named.end())) << place;
        }
        ++tables;
    });
    return tables;
}

int expect_ranges_are_the_readers(const FormatCase& format) {
    int ranges = 0;
    for_each_value(format, [&](const json& node, const Place& place, const std::string& key) {
        const bool array = node.contains("items") && node["items"].contains("minimum");
        const json& range = array ? node["items"] : node.contains("anyOf") ? node["anyOf"][0] : node;
        if (!range.contains("minimum")) return;
        const double low = range["minimum"].get<double>(), high = range["maximum"].get<double>();
        const bool whole = range["type"] == "integer";
        const std::string words = fmt::format("from {} to {}", low, high);
        const auto refusal_at = [&](double value) {
            const json number = whole ? json(static_cast<std::int64_t>(value)) : json(value);
            const std::size_t size = array ? node["minItems"].get<std::size_t>() : 0;
            return refusal_with(format, place / key, array ? json(std::vector<json>(size, number)) : number);
        };
        const auto beyond = [&](double limit) {
            return whole ? 1 : std::max(1e-12, 1e-12 * std::abs(limit));
        };
        for (const double value : {low, high})
            EXPECT_FALSE(holds(refusal_at(value), words)) << place << " " << key << " = " << value;
        for (const double value : {low - beyond(low), high + beyond(high)})
            EXPECT_TRUE(holds(refusal_at(value), words))
                << place << " " << key << " = " << value << ": " << refusal_at(value);
        ++ranges;
    });
    return ranges;
}

int expect_types_are_the_readers(const FormatCase& format) {
    int keys = 0;
    for_each_value(format, [&](const json& node, const Place& place, const std::string& key) {
        const std::string other = refusal_with(format, place / key, json::array({json::array()}));
        EXPECT_TRUE(holds(other, " error: found ")) << place << " " << key << ": " << other;
        EXPECT_TRUE(holds(other, key) || holds(other, "an array in "))
            << place << " " << key << ": " << other;
        if (node.contains("enum")) {
            for (const json& word : node["enum"])
                EXPECT_FALSE(holds(refusal_with(format, place / key, word), key + " = " + word.dump()))
                    << place << " " << key << " = " << word;
            EXPECT_TRUE(holds(refusal_with(format, place / key, "no such word"), "expected one of "))
                << place << " " << key;
        }
        ++keys;
    });
    return keys;
}

int expect_required_keys_are_the_readers(const FormatCase& format, const std::vector<std::string>& needed) {
    int keys = 0;
    for_each_table(format, [&](const json& table, const Place& place) {
        if (!format.full.contains(place)) return;
        const json required = table.value("required", json::array());
        for (const auto& [key, node] : format.full[place].items()) {
            json file = format.full;
            file[place].erase(key);
            const std::string refusal = format.refusal(file);
            if (std::find(required.begin(), required.end(), key) != required.end()) {
                EXPECT_TRUE(holds(refusal, fmt::format("no key \"{}\"", key))) << place << ": " << refusal;
            } else if (std::find(needed.begin(), needed.end(), (place / key).to_string()) == needed.end()) {
                EXPECT_EQ(refusal, "") << place << " without " << key;
            }
            ++keys;
        }
    });
    return keys;
}

}  // namespace app
