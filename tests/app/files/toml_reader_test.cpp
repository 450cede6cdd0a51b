#include "files/toml_reader.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "files/bad_input.h"

namespace app {
namespace {

using Declaration = std::function<void(Fields&)>;

void read(const std::vector<std::string>& layers, const Declaration& keys, bool all = true) {
    std::vector<TomlFile> files;
    for (const std::string& text : layers) files.emplace_back(text, "test.toml");
    read_toml(files, "test", keys, all);
}

/// The message of the BadInput that reading ends with.
std::string refusal_of(const std::vector<std::string>& layers, const Declaration& keys, bool all = true) {
    try {
        read(layers, keys, all);
    } catch (const BadInput& wrong) {
        return wrong.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

/// Declares one number without a default.
Declaration number_of(const std::string& key, double low, double high) {
    return [=](Fields& keys) {
        double value = 0;
        keys.number(key, value, {low, high}, "", {.need = Need::given});
    };
}

struct Inner {
    double x = 0, y = 0;
};
void inner_keys(Fields& keys, Inner& inner) {
    keys.number("x", inner.x, {0, 100}, "");
    keys.number("y", inner.y, {0, 100}, "");
}
const TableKind<Inner> kInner = {{"inner", "An inner table."}, inner_keys};

TEST(TomlReader, TheFirstLayerThatHasAKeyGivesItsValue) {
    double a = 0, b = 0;
    Inner inner;
    read({"a = 1\n[inner]\nx = 10", "a = 2\nb = 3\n[inner]\nx = 20\ny = 30"}, [&](Fields& keys) {
        keys.number("a", a, {0, 10}, "");
        keys.number("b", b, {0, 10}, "");
        keys.table("inner", inner, kInner);
    });
    EXPECT_EQ(a, 1);
    EXPECT_EQ(b, 3);
    EXPECT_EQ(inner.x, 10);
    EXPECT_EQ(inner.y, 30);
}

// Faults of the parser quote what they found.
TEST(TomlReader, RefusalsAreOneLineWithoutControlCharactersWhateverByteStandsWhere) {
    const std::string text = "a = true\n[\"b\"]\nc = 1979-05-27\n";
    for (std::size_t at = 0; at <= text.size(); ++at)
        for (int byte = 0; byte < 256; ++byte) {
            std::string damaged = text;
            damaged.insert(at, 1, static_cast<char>(byte));
            try {
                read({damaged}, [](Fields& keys) {
                    bool a = false;
                    keys.flag("a", a, "");
                });
            } catch (const BadInput& wrong) {
                EXPECT_TRUE(std::ranges::none_of(std::string_view(wrong.what()), is_control))
                    << "byte " << byte << " at " << at << ": " << wrong.what();
            }
        }
}

TEST(TomlReader, RangesAreClosedAndNumbersMustBeFinite) {
    const std::string text =
        "low = 1\nhigh = 2.0\nbelow = 0.999\nabove = 2.001\nnan = nan\ninf = inf\ntext = \"1\"\nflag = true";
    for (const char* key : {"low", "high"}) read({text}, number_of(key, 1, 2), false);
    for (const char* key : {"below", "above", "nan", "inf", "text", "flag"})
        EXPECT_NE(refusal_of({text}, number_of(key, 1, 2)).find("expected a number from 1 to 2"),
                  std::string::npos)
            << key;
}

void needy_keys(Fields& keys, Inner& inner) {
    keys.number("x", inner.x, {0, 1}, "");
    keys.number("y", inner.y, {0, 1}, "", {.need = Need::given});
}
const TableKind<Inner> kNeedy = {{"inner", "An inner table that must have y."}, needy_keys};

TEST(TomlReader, AMissingKeyLeavesTheValueOrFailsAtTheTable) {
    const std::string text = "\n\n[inner]\nx = 1";
    Inner inner{0, 0.5};
    bool z = true;
    std::string t = "word";
    std::optional<double> none;
    read({text}, [&](Fields& keys) {
        keys.table("inner", inner, kInner);
        keys.flag("z", z, "");
        keys.text("t", t, "");
        keys.number("none", none, {0, 1}, "");
    });
    EXPECT_EQ(inner.x, 1);
    EXPECT_EQ(inner.y, 0.5);
    EXPECT_TRUE(z);
    EXPECT_EQ(t, "word");
    EXPECT_FALSE(none);
    EXPECT_EQ(refusal_of({text}, [&](Fields& keys) { keys.table("inner", inner, kNeedy); }),
              "test.toml:3:1: error: found no key \"y\" in test, inner, expected a number from 0 to 1");
}

TEST(TomlReader, UnknownKeysAreRefusedAtTheirPlaceWithTheKnownOnes) {
    EXPECT_EQ(refusal_of({"a = 1\n  colour = 2"},
                         [](Fields& keys) {
                             double value = 0;
                             keys.number("a", value, {0, 1}, "");
                             keys.number("b", value, {0, 1}, "");
                         }),
              "test.toml:2:3: error: found unknown key \"colour\" in test, expected only a, b");
}

TEST(TomlReader, ArraysFailAtTheEntryThatIsWrong) {
    const std::string text = "v = [1, 2,\n     \"x\"]\nshort = [1, 2]\nnumber = 3";
    const auto vector = [](const char* key) {
        return [=](Fields& keys) {
            Eigen::Vector3d value(0, 0, 0);
            keys.vector(key, value, {0, 9}, "");
        };
    };
    EXPECT_EQ(refusal_of({text}, vector("v")).substr(0, 14), "test.toml:2:6:");
    EXPECT_NE(refusal_of({text}, vector("short")).find("short with 2 entries"), std::string::npos);
    EXPECT_NE(refusal_of({text}, vector("number")).find("number = 3"), std::string::npos);
}

TEST(TomlReader, WrongKindsAreNamed) {
    const auto expect = [](const std::string& text, const Declaration& keys, const char* part) {
        const std::string refusal = refusal_of({text}, keys);
        EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
    };
    std::string text;
    bool flag = false;
    int whole = 0;
    Inner inner;
    std::vector<std::string> texts;
    expect(
        "t = { a = 1 }", [&](Fields& keys) { keys.text("t", text, ""); }, "t = a table");
    expect(
        "array = [1]", [&](Fields& keys) { keys.flag("array", flag, ""); }, "array = an array");
    expect(
        "whole = 3.5",
        [&](Fields& keys) {
            keys.integer("whole", whole, {0, 9}, "");
        },
        "a whole number from 0 to 9");
    expect("day = 2024-01-01", number_of("day", 0, 9), "a date or time");
    expect(
        "array = [1]", [&](Fields& keys) { keys.table("array", inner, kInner); }, "expected a table");
    expect(
        "array = [1]", [&](Fields& keys) { keys.tables("array", inner, kInner, "", [](Fields&, Inner&) {}); },
        "expected a table");
    expect(
        "array = [1]", [&](Fields& keys) { keys.texts("array", texts, ""); }, "expected a text");
    expect(
        "t = { a = 1 }",
        [&](Fields& keys) {
            keys.choice("t", whole, {{"x", 1}}, "");
        },
        "expected a text");
    expect(
        "t = \"y\"",
        [&](Fields& keys) {
            keys.choice("t", whole, {{"x", 1}, {"z", 2}}, "");
        },
        "found t = \"y\" in test, expected one of x, z");
}

TEST(TomlReader, AWrongTableInALowerLayerIsNotPassedOver) {
    Inner inner;
    EXPECT_NE(
        refusal_of({"[sound]\nx = 1", "sound = 3"}, [&](Fields& keys) { keys.table("sound", inner, kInner); })
            .find("found sound = 3"),
        std::string::npos);
}

TEST(TomlReader, MessagesStayOneLineWhateverTheFileHolds) {
    const std::string text = "a = \"x\\ny\"\n\"k\\ney\" = 1";
    std::string value;
    for (const Declaration& keys : {Declaration([&](Fields& f) { f.text("a", value, ""); }),
                                    number_of("a", 0, 1), Declaration([](Fields&) {})})
        EXPECT_EQ(refusal_of({text}, keys).find('\n'), std::string::npos);
}

/// A person whose [defaults] may give the age but not the name.
struct Person {
    std::string name;
    int age = 0;
};
void person_keys(Fields& keys, Person& person) {
    keys.text("name", person.name, "", {.need = Need::here});
    keys.integer("age", person.age, {0, 150}, "", {.need = Need::given});
}
const TableKind<Person> kPerson = {{"person", "A person.", Below::defaults}, person_keys};

TEST(TomlReader, DefaultsStandBelowEveryTableOfTheirKindButForWhatItMustSayItself) {
    std::vector<Person> people;
    const auto keys = [&](Fields& f) {
        f.partial_table("defaults", kPerson);
        f.tables("person", Person(), kPerson, "", [&](Fields&, const Person& p) { people.push_back(p); });
    };
    read({"person = [{ name = \"a\" }, { name = \"b\", age = 3 }]\n[defaults]\nage = 7"}, keys);
    ASSERT_EQ(people.size(), 2u);
    EXPECT_EQ(people[0].age, 7);
    EXPECT_EQ(people[1].age, 3);
    EXPECT_EQ(refusal_of({"person = [{ age = 1 }]"}, keys),
              "test.toml:1:11: error: found no key \"name\" in test, person, expected name = \"text\"");
    EXPECT_NE(refusal_of({"person = [{ name = \"a\" }]\n[defaults]\nname = \"b\"\nage = 1"}, keys)
                  .find("test.toml:3:1: error: found unknown key \"name\" in person \"a\""),
              std::string::npos);
    EXPECT_NE(refusal_of({"person = [{ name = \"a\" }]"}, keys).find("no key \"age\" in person \"a\""),
              std::string::npos);
}

TEST(TomlReader, AFailureNamesThePlaceOfTheKeyOrOfTheTable) {
    const auto complain = [](const char* key) {
        return [=](Fields& keys) {
            Inner inner;
            keys.table("inner", inner, kInner, [&](Fields& at, Inner&) { at.require(false, key, "F", "E"); });
        };
    };
    const std::string text = "\n[inner]\n  x = 1";
    EXPECT_EQ(refusal_of({text}, complain("x")), "test.toml:3:7: error: found F in test, inner, expected E");
    EXPECT_EQ(refusal_of({text}, complain("y")), "test.toml:2:1: error: found F in test, inner, expected E");
    EXPECT_EQ(refusal_of({text}, complain("")), "test.toml:2:1: error: found F, expected E");
}

}  // namespace
}  // namespace app
