// The reference pages in docs/ are made from the declarations of kits, scenes and maps.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "files/format_description.h"
#include "kit/kit.h"
#include "scene/scene.h"
#include "traces/map_file.h"

namespace app {
namespace {

void expect_page(const FormatDescription& format, const std::string& command, const std::string& page) {
    std::ifstream file(std::string(MUSICWORLD_SOURCE_DIR) + "/" + page);
    std::stringstream text;
    text << file.rdbuf();
    EXPECT_TRUE(text.str() == reference_page(format, command))
        << page << " is out of date; remake it with: " << command << " > " << page;
}

TEST(ReferencePages, AreWhatTheProgramPrints) {
    expect_page(kit_format(), "musicworld schema kit --markdown", "docs/reference-kits.md");
    expect_page(scene_format(), "musicworld schema scene --markdown", "docs/reference-scenes.md");
    expect_page(map_format(), "musicworld schema map --markdown", "docs/reference-maps.md");
}

}  // namespace
}  // namespace app
