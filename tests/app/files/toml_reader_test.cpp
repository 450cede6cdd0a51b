#include "files/toml_reader.h"

#include <gtest/gtest.h>

#include <functional>

#include "files/bad_input.h"

namespace app {
namespace {

toml::table parsed(std::string_view text) {
    return toml::parse(text, std::string_view("test.toml"));
}

/// The message of the BadInput that an action ends with.
std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const BadInput& wrong) {
        return wrong.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

TEST(TomlReader, TheFirstLayerThatHasAKeyGivesItsValue) {
    const toml::table first = parsed("a = 1\n[inner]\nx = 10"),
                      second = parsed("a = 2\nb = 3\n[inner]\nx = 20\ny = 30");
    TomlReader reader({&first, &second}, "test");
    EXPECT_EQ(reader.number("a", 0, 10), 1);
    EXPECT_EQ(reader.number("b", 0, 10), 3);
    TomlReader inner = reader.table("inner");
    EXPECT_EQ(inner.number("x", 0, 100), 10);
    EXPECT_EQ(inner.number("y", 0, 100), 30);
    inner.done();
    reader.done();
}

TEST(TomlReader, RangesAreClosedAndNumbersMustBeFinite) {
    const toml::table table = parsed(
        "low = 1\nhigh = 2.0\nbelow = 0.999\nabove = 2.001\nnan = nan\ninf = inf\ntext = \"1\"\nflag = true");
    TomlReader reader({&table}, "test");
    EXPECT_EQ(reader.number("low", 1, 2), 1);
    EXPECT_EQ(reader.number("high", 1, 2), 2);
    for (const char* key : {"below", "above", "nan", "inf", "text", "flag"})
        EXPECT_NE(message_of([&] { (void)reader.number(key, 1, 2); }).find("expected a number from 1 to 2"),
                  std::string::npos)
            << key;
}

TEST(TomlReader, AMissingKeyGivesTheFallbackOrFailsAtTheTable) {
    const toml::table table = parsed("\n\n[inner]\nx = 1");
    TomlReader inner = TomlReader({&table}, "test").table("inner");
    EXPECT_EQ(inner.number("y", 0, 1, 0.5), 0.5);
    EXPECT_TRUE(inner.flag("z", true));
    EXPECT_EQ(inner.text("t", "word"), "word");
    EXPECT_EQ(message_of([&] { (void)inner.number("y", 0, 1); }),
              "test.toml:3:1: error: found no key \"y\" in test, inner, expected a number from 0 to 1");
}

TEST(TomlReader, UnknownKeysAreRefusedAtTheirPlaceWithTheKnownOnes) {
    const toml::table table = parsed("a = 1\n  colour = 2");
    TomlReader reader({&table}, "test");
    (void)reader.number("a", 0, 1);
    (void)reader.number("b", 0, 1, 0.0);
    EXPECT_EQ(message_of([&] { reader.done(); }),
              "test.toml:2:3: error: found unknown key \"colour\" in test, expected only a, b");
}

TEST(TomlReader, ArraysFailAtTheEntryThatIsWrong) {
    const toml::table table = parsed("v = [1, 2,\n     \"x\"]\nshort = [1, 2]\nnumber = 3");
    TomlReader reader({&table}, "test");
    EXPECT_EQ(message_of([&] { (void)reader.vector("v", 0, 9); }).substr(0, 14), "test.toml:2:6:");
    EXPECT_NE(message_of([&] { (void)reader.vector("short", 0, 9); }).find("short with 2 entries"),
              std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.vector("number", 0, 9); }).find("number = 3"), std::string::npos);
}

TEST(TomlReader, WrongKindsAreNamed) {
    const toml::table table = parsed("t = { a = 1 }\narray = [1]\nwhole = 3.5\nday = 2024-01-01");
    TomlReader reader({&table}, "test");
    EXPECT_NE(message_of([&] { (void)reader.text("t"); }).find("t = a table"), std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.flag("array"); }).find("array = an array"), std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.integer("whole", 0, 9); }).find("a whole number from 0 to 9"),
              std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.number("day", 0, 9); }).find("a date or time"),
              std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.table("array"); }).find("expected a table"), std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.tables("array"); }).find("expected a table"), std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.texts("array"); }).find("expected a text"), std::string::npos);
    EXPECT_NE(message_of([&] { (void)reader.choice("t", {"x"}); }).find("expected a text"),
              std::string::npos);
}

TEST(TomlReader, AWrongTableInALowerLayerIsNotPassedOver) {
    const toml::table first = parsed("[sound]\ngain = 1"), second = parsed("sound = 3");
    TomlReader reader({&first, &second}, "test");
    EXPECT_NE(message_of([&] { (void)reader.table("sound"); }).find("found sound = 3"), std::string::npos);
}

TEST(TomlReader, MessagesStayOneLineWhateverTheFileHolds) {
    const toml::table table = parsed("a = \"x\\ny\"\n\"k\\ney\" = 1");
    TomlReader reader({&table}, "test");
    EXPECT_EQ(message_of([&] { (void)reader.text("a"); }).find('\n'), std::string::npos);
    EXPECT_EQ(message_of([&] { (void)reader.number("a", 0, 1); }).find('\n'), std::string::npos);
    EXPECT_EQ(message_of([&] { reader.done(); }).find('\n'), std::string::npos);
}

}  // namespace
}  // namespace app
