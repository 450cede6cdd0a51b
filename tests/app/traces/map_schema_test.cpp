// The JSON Schema of the map format and the reader know the same keys, types and ranges.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "files/bad_input.h"
#include "schema_walk.h"
#include "traces/map_file.h"

namespace app {
namespace {

std::string refusal_of(const json& map) {
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) /
                                       ("musicworld_map_" + std::to_string(::getpid()) + ".toml");
    std::ofstream(file) << toml_text(map);
    std::string refusal;
    try {
        (void)read_map(file);
    } catch (const BadInput& wrong) {
        refusal = wrong.what();
    }
    std::filesystem::remove(file);
    return refusal;
}

const FormatCase& map_case() {
    static const FormatCase format = [] {
        const json root = json::parse(json_schema(map_format()));
        return FormatCase{root, example_of(root, root), refusal_of, [](json&, const json::json_pointer&) {}};
    }();
    return format;
}

TEST(MapSchema, EveryKeyThatItNamesIsReadAtItsExample) {
    EXPECT_EQ(refusal_of(map_case().full), "");
}

TEST(MapSchema, EveryKeyIsDescribed) {
    EXPECT_EQ(expect_every_key_is_described(map_case()), 21);
}

TEST(MapSchema, TheReaderKnowsExactlyTheSchemasKeysTypesAndRanges) {
    EXPECT_EQ(expect_unknown_keys_are_refused(map_case(), {}), 1);
    EXPECT_EQ(expect_ranges_are_the_readers(map_case()), 2);
    EXPECT_EQ(expect_types_are_the_readers(map_case()), 21);
    EXPECT_EQ(expect_required_keys_are_the_readers(map_case(), {}), 21);
}

}  // namespace
}  // namespace app
