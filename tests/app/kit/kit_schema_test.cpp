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

/// The files that the examples name, beside the written kit; several processes may do this at once.
void write_named_files() {
    const std::filesystem::path folder = ::testing::TempDir(),
                                own = "musicworld_" + std::to_string(::getpid());
    const auto put = [&](const char* name) { std::filesystem::rename(folder / own, folder / name); };
    (void)audio::write_wav(folder / own, std::vector<float>(64, 0.5F));
    put("snare.wav");
    (void)audio::write_wav(folder / own, std::vector<float>(64, 0.5F));
    put("hall.wav");
    std::ofstream(folder / own) << ";@ gong frequency_hz 100 20 2000 pitch [Hz]\ninstr gong\nendin\n";
    put("mine.orc");
    std::ofstream(folder / own) << "[[instrument]]\nname = \"C5\"\nkind = \"bell\"\n";
    put("removed.toml");
}

const FormatCase& kit_case() {
    static const FormatCase format = [] {
        write_named_files();
        const json root = json::parse(json_schema(kit_format()));
        json full = example_of(root, root);
        full["include"] = {"defaults.toml",
                           "removed.toml"};  // bells would take the defaults' sound, which is a drum's
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
    // What the file removes is in what it includes; an instrument that changes an included one leaves its kind to it.
    // An instrument names its bus.
    for (const char* key : {"/defaults", "/instrument", "/include", "/instrument/0/kind", "/bus"})
        needed.push_back(key);
    EXPECT_GT(expect_required_keys_are_the_readers(kit_case(), needed), 250);
}

}  // namespace
}  // namespace app
