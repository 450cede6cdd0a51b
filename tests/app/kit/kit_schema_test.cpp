// The JSON Schema of the kit format and the reader know the same keys, types and ranges.
#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "files/format_description.h"
#include "kit/kit.h"
#include "schema_walk.h"
#include "written_kit.h"

namespace app {
namespace {

std::string refusal_of(const json& kit) {
    const WrittenKit written(toml_text(kit));
    try {
        (void)written.read();
    } catch (const BadInput& wrong) {
        return wrong.what();
    }
    return {};
}

const FormatCase& kit_case() {
    static const FormatCase format = [] {
        const json root = json::parse(json_schema(kit_format()));
        json full = example_of(root, root);
        full["include"] = {"defaults.toml"};  // bells would take the defaults' sound, which is a drum's
        // Instruments take what they say before what the defaults say; so that defaults are read too, each kind
        // has one that says little.
        for (const char* kind : {"drum", "cymbal", "bell", "string"})
            full["instrument"].push_back({{"name", kind}, {"kind", kind}});
        return FormatCase{root, full, refusal_of, [](json& file, const json::json_pointer& place) {
                              if (place.to_string().starts_with("/defaults/")) file["instrument"].erase(0);
                          }};
    }();
    return format;
}

TEST(KitSchema, EveryKeyThatItNamesIsReadAtItsExample) {
    EXPECT_EQ(refusal_of(kit_case().full), "");
}

TEST(KitSchema, EveryKeyIsDescribed) {
    EXPECT_GT(expect_every_key_is_described(kit_case()), 200);
}

TEST(KitSchema, AnUnknownKeyIsRefusedInEveryTableAndTheReaderKnowsExactlyTheSchemasKeys) {
    EXPECT_GT(expect_unknown_keys_are_refused(kit_case(), {"name", "kind"}), 60);
}

TEST(KitSchema, ItsRangesAreTheReaders) {
    EXPECT_GT(expect_ranges_are_the_readers(kit_case()), 200);
}

TEST(KitSchema, ItsTypesAndWordsAreTheReaders) {
    EXPECT_GT(expect_types_are_the_readers(kit_case()), 250);
}

TEST(KitSchema, WhatItRequiresTheReaderRequires) {
    std::vector<std::string> needed;  // by the instruments that leave them to the defaults
    for (const std::string kind : {"drum", "cymbal", "bell", "string"})
        for (const char* key : {"", "/size", "/position"}) needed.push_back("/defaults/" + kind + key);
    for (const char* key : {"/defaults", "/instrument"}) needed.push_back(key);
    EXPECT_GT(expect_required_keys_are_the_readers(kit_case(), needed), 250);
}

}  // namespace
}  // namespace app
