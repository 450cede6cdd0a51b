// The JSON Schema of the scene format and the reader must know the same keys and ranges.
#include <gtest/gtest.h>

#include <sstream>

#include "files/assets.h"
#include "kit/kit.h"
#include "schema_walk.h"
#include "written_scene.h"

namespace app {
namespace {

json schema() {
    std::ifstream file(assets_folder() / "scenes" / "scene.schema.json");
    return json::parse(file);
}

json full_scene(const json& root) {
    return example_of(root, root);
}

std::string refusal_of(const json& scene) {
    return WrittenScene(toml_text(scene)).refusal();
}

TEST(SceneSchema, EveryKeyThatItNamesIsReadAtItsExample) {
    EXPECT_EQ(refusal_of(full_scene(schema())), "");
}

TEST(SceneSchema, EveryKeyIsDescribed) {
    const json root = schema();
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        for (const auto& [key, inner] : table["properties"].items())
            EXPECT_FALSE(resolved(root, inner).value("description", "").empty()) << place << " " << key;
    });
}

TEST(SceneSchema, AnUnknownKeyIsRefusedInEveryTableAndTheReaderKnowsNoneThatTheSchemaDoesNotName) {
    const json root = schema();
    int tables = 0;
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        json scene = full_scene(root);
        scene[place / "no_such_key"] = 1;
        const std::string refusal = refusal_of(scene), before = ", expected only ";
        EXPECT_NE(refusal.find("unknown key \"no_such_key\""), std::string::npos) << place << ": " << refusal;
        const std::size_t at = refusal.find(before);
        ASSERT_NE(at, std::string::npos) << place << ": " << refusal;
        std::istringstream known(refusal.substr(at + before.size()));
        for (std::string key; std::getline(known >> std::ws, key, ',');) {
            // Defaults are read by the body's reader: that they may say these, too, is of no use.
            const bool of_body =
                place.to_string() == "/defaults" && (key == "name" || key == "grid" || key == "bumps");
            EXPECT_TRUE(table["properties"].contains(key) || of_body) << place << ": " << key;
        }
        ++tables;
    });
    EXPECT_GE(tables, 15);
}

TEST(SceneSchema, NumbersOutsideItsRangesAreRefused) {
    const json root = schema();
    int ranges = 0;
    for_each_table(root, root, json::json_pointer(), [&](const json& table, const json::json_pointer& place) {
        for (const auto& [key, node] : table["properties"].items()) {
            const bool array = node.contains("items") && node["items"].contains("minimum");
            const json& range = array ? node["items"] : node.contains("anyOf") ? node["anyOf"][0] : node;
            if (!range.contains("minimum")) continue;
            for (const double value :
                 {range["minimum"].get<double>() - 1, range["maximum"].get<double>() + 1}) {
                json scene = full_scene(root);
                json number =
                    range["type"] == "integer" ? json(static_cast<std::int64_t>(value)) : json(value);
                scene[place / key] =
                    array ? json(std::vector<json>(node["minItems"].get<std::size_t>(), number)) : number;
                // The body's own value hides that of the defaults.
                if (place.to_string().starts_with("/defaults"))
                    for (json& body : scene["body"]) body.erase(key);
                EXPECT_NE(refusal_of(scene), "") << place << " " << key << " = " << value;
                ++ranges;
            }
        }
    });
    EXPECT_GT(ranges, 120);
}

}  // namespace
}  // namespace app
