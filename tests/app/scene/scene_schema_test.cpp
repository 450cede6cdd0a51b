// The JSON Schema of the scene format and the reader know the same keys, types and ranges.
#include <gtest/gtest.h>

#include "files/format_description.h"
#include "scene/scene.h"
#include "schema_walk.h"
#include "written_scene.h"

namespace app {
namespace {

std::string refusal_of(const json& scene) {
    return WrittenScene(toml_text(scene)).refusal();
}

json without(json table, std::initializer_list<const char*> keys) {
    for (const char* key : keys) table.erase(key);
    return table;
}

/// Every key stands at one place at least where it contradicts no other.
json full_scene(const json& root) {
    json scene = example_of(root, root);
    const json body = scene["body"][0], constraint = scene["constraint"][0], event = scene["event"][0];
    scene["material"] = {{"soft", scene["material"]["one"]}};
    scene["defaults"] = without(scene["defaults"], {"radius", "size", "bumps", "grid", "motion"});
    json grid = without(body, {"radius", "motion"}), ball = without(body, {"radius", "grid"});
    grid["name"] = "grid", ball["name"] = "ball";
    scene["body"] = json::array({grid, ball, {{"name", "other"}, {"radius", 0.5}, {"bumps", json::array()}}});
    json hinge = without(constraint, {"at", "place"});
    hinge["type"] = "hinge";
    scene["constraint"] =
        json::array({hinge, {{"body", "ball"}, {"at", {0, 1, 0}}}, {{"body", "ball"}, {"place", {0, 2, 0}}}});
    json late = grid;
    late["name"] = "late";
    scene["event"] = json::array({without(event, {"step"}),
                                  {{"step", 30}, {"delete", {"string"}}},
                                  {{"step", 31}, {"push", {{"body", "other"}, {"impulse", {0, 1, 0}}}}}});
    scene["event"][0]["add"] = late;
    scene["event"][0]["push"] = without(event["push"], {"impulse"});
    scene["event"][0]["push"]["body"] = "other";
    return scene;
}

/// The body's own value hides that of the defaults.
void uncover(json& scene, const json::json_pointer& place) {
    const std::string at = place.to_string(), defaults = "/defaults/";
    if (!at.starts_with(defaults)) return;
    const std::string key = at.substr(defaults.size(), at.find('/', defaults.size()) - defaults.size());
    if (key == "grid") scene["defaults"][key] = {{"count", {2, 1, 2}}, {"step", {1, 1, 1}}};
    if (key == "bumps") scene["defaults"][key] = json::array({{{"direction", {0, 1, 0}}, {"height", 0.1}}});
    for (json& body : scene["body"]) body.erase(key);
    scene["event"][0]["add"].erase(key);
    if (key == "size" || key == "radius")
        for (const char* other : {"size", "radius"})
            for (json& body : scene["body"]) body.erase(other);
}

const FormatCase& scene_case() {
    static const FormatCase format = [] {
        const json root = json::parse(json_schema(scene_format()));
        return FormatCase{root, full_scene(root), refusal_of, uncover};
    }();
    return format;
}

TEST(SceneSchema, EveryKeyThatItNamesIsReadAtItsExample) {
    EXPECT_EQ(refusal_of(scene_case().full), "");
}

TEST(SceneSchema, EveryKeyIsDescribed) {
    EXPECT_GT(expect_every_key_is_described(scene_case()), 120);
}

TEST(SceneSchema, AnUnknownKeyIsRefusedInEveryTableAndTheReaderKnowsExactlyTheSchemasKeys) {
    EXPECT_GE(expect_unknown_keys_are_refused(scene_case(), {"name"}), 15);
}

TEST(SceneSchema, ItsRangesAreTheReaders) {
    EXPECT_GT(expect_ranges_are_the_readers(scene_case()), 90);
}

TEST(SceneSchema, ItsTypesAndWordsAreTheReaders) {
    EXPECT_GT(expect_types_are_the_readers(scene_case()), 110);
}

TEST(SceneSchema, WhatItRequiresTheReaderRequires) {
    EXPECT_GT(expect_required_keys_are_the_readers(
                  scene_case(), {"/body", "/constraint", "/material", "/material/soft", "/body/0/size",
                                 "/body/0/grid", "/event/0/time", "/event/0/add/size", "/constraint/0/to",
                                 "/constraint/0/name", "/constraint/0/type", "/constraint/0/axis",
                                 "/event/0/push/force", "/event/0/push/seconds"}),
              120);
}

}  // namespace
}  // namespace app
