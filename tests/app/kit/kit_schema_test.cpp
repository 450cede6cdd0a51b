// The JSON Schema of the kit format and the reader must know the same keys and ranges.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "files/assets.h"
#include "files/bad_input.h"
#include "schema_walk.h"
#include "written_kit.h"

namespace app {
namespace {

using nlohmann::json;

json schema() {
    std::ifstream file(assets_folder() / "kits" / "kit.schema.json");
    return json::parse(file);
}

std::string refusal_of(const json& kit) {
    const WrittenKit written(toml_text(kit));
    try {
        (void)written.read();
    } catch (const BadInput& wrong) {
        return wrong.what();
    }
    return {};
}

json full_kit(const json& root) {
    json kit = example_of(root, root);
    // Instruments take what they say before what the defaults say; so that defaults are read too, each kind
    // has one that says little.
    for (const char* kind : {"drum", "cymbal", "bell", "string"})
        kit["instrument"].push_back({{"name", kind}, {"kind", kind}});
    return kit;
}

TEST(KitSchema, EveryKeyThatItNamesIsReadAtItsExample) {
    const json root = schema();
    EXPECT_EQ(refusal_of(full_kit(root)), "");
}

TEST(KitSchema, EveryKeyIsDescribed) {
    const json root = schema();
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        for (const auto& [key, inner] : table["properties"].items())
            EXPECT_FALSE(resolved(root, inner).value("description", "").empty()) << place << " " << key;
    });
}

TEST(KitSchema, AnUnknownKeyIsRefusedInEveryTableThatItDescribes) {
    const json root = schema();
    int tables = 0;
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        json kit = full_kit(root);
        // In a table of free parameters only a value that is no number is wrong.
        kit[place / "no_such_key"] = "text";
        const std::string refusal = refusal_of(kit);
        EXPECT_NE(refusal.find("no_such_key"), std::string::npos) << place << ": " << refusal;
        if (table["additionalProperties"].is_boolean()) {
            EXPECT_NE(refusal.find("unknown key"), std::string::npos) << place << ": " << refusal;
        }
        ++tables;
    });
    EXPECT_GT(tables, 20);
}

TEST(KitSchema, TheReaderKnowsNoKeyThatItDoesNotName) {
    const json root = schema();
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        if (!table["additionalProperties"].is_boolean()) return;
        json kit = full_kit(root);
        kit[place / "no_such_key"] = 1;
        const std::string refusal = refusal_of(kit);
        const std::string before = ", expected only ";
        const std::size_t at = refusal.find(before);
        ASSERT_NE(at, std::string::npos) << place << ": " << refusal;
        std::istringstream known(refusal.substr(at + before.size()));
        for (std::string key; std::getline(known >> std::ws, key, ',');) {
            // Defaults are read by the same reader as the instrument, which alone may have a name and a kind.
            const bool of_instrument =
                place.to_string().starts_with("/defaults/") && (key == "name" || key == "kind");
            EXPECT_TRUE(table["properties"].contains(key) || of_instrument) << place << ": " << key;
        }
    });
}

TEST(KitSchema, NumbersOutsideItsRangesAreRefused) {
    const json root = schema();
    int ranges = 0;
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        for (const auto& [key, node] : table["properties"].items()) {
            const bool array = node.contains("items") && node["items"].contains("minimum");
            const json& range = array ? node["items"] : node;
            if (!range.contains("minimum")) continue;
            for (const double value :
                 {range["minimum"].get<double>() - 1, range["maximum"].get<double>() + 1}) {
                json kit = full_kit(root);
                const json::json_pointer at = array ? place / key / 0 : place / key;
                kit[at] = range["type"] == "integer" ? json(static_cast<int>(value)) : json(value);
                // A later table would hide the defaults' value behind the instrument's own.
                if (place.to_string().starts_with("/defaults/")) kit["instrument"].erase(0);
                EXPECT_NE(refusal_of(kit), "") << at << " = " << value;
                ++ranges;
            }
        }
    });
    EXPECT_GT(ranges, 100);
}

}  // namespace
}  // namespace app
