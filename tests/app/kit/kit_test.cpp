#include "kit/kit.h"

#include <gtest/gtest.h>

#include <random>

#include "files/assets.h"
#include "files/bad_input.h"
#include "written_kit.h"

namespace app {
namespace {

constexpr const char* kGood = R"(name = "Test"
description = "one of each"

[stick]
radius = 0.01

[camera]
eye = [0, 1.5, 1]

[[instrument]]
name = "snare"
kind = "drum"
size = [0.36, 0.16, 0.36]
position = [-0.1, 0.7, -0.4]
tilt_deg = [10, 0, 0]
sound = { frequency_hz = 200, gain_db = -3 }

[[instrument]]
name = "bell"
kind = "bell"
size = [0.1, 0.12, 0.1]
position = [0.3, 1, -0.5]
orientation = [0.7071068, 0, 0.7071068, 0]
midi_note = 80
zones = [{ name = "side" }, { name = "crown", radius = [0, 0.2], midi_note = 81 }]
)";

struct MalformedKit {
    const char* what;
    std::string text;
    const char* place;  // LINE:COLUMN
    const char* found;  // part of the message
};

std::string instrument(const std::string& lines) {
    return "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1, 1]\nposition = [0, 0, 0]\n" + lines;
}

TEST(Kit, ReadsWhatTheFileSaysAndTheDefaultsBelowIt) {
    const WrittenKit written(kGood);
    const Kit kit = written.read();
    EXPECT_EQ(kit.name, "Test");
    EXPECT_EQ(kit.description, "one of each");
    EXPECT_EQ(kit.stick.radius_m, 0.01);
    EXPECT_EQ(kit.stick.length_m, 0.40);  // defaults.toml
    ASSERT_EQ(kit.instruments.size(), 2u);
    const Instrument &snare = kit.instruments[0], &bell = kit.instruments[1];
    EXPECT_TRUE(snare.body.shape.semi_axes.isApprox(Eigen::Vector3d(0.18, 0.08, 0.18)));
    EXPECT_EQ(snare.body.shape.e1, 0.1);
    EXPECT_EQ(snare.voice.instrument, "drum");
    EXPECT_EQ(snare.voice.gain_db, -3);
    // Its own, and what its sound wants to know of the stick.
    EXPECT_EQ(
        snare.voice.parameters,
        (std::vector<std::pair<std::string, double>>{
            {"frequency_hz", 200}, {"tip_radius_m", 0.01}, {"tip_mass_kg", 0.05}, {"tip_young_pa", 1e10}}));
    EXPECT_EQ(snare.zones[0].name, "head");
    EXPECT_EQ(snare.mesh.filename(), "drum.obj");
    EXPECT_EQ(bell.zones[0].midi_note, 80);
    EXPECT_EQ(bell.zones[1].midi_note, 81);
    EXPECT_TRUE(bell.body.stand.hinged);
}

TEST(Kit, TheStickIsHeardUnlessAnInstrumentSaysOtherwiseAndTheMixIsRead) {
    const WrittenKit written(
        "[stick]\nyoung_pa = 2e6\n[mix]\ngain_db = -4\nroom_t60_s = 2\n" +
        instrument("sound = { tip_young_pa = 3e7 }\n") +
        "[[instrument]]\nname = \"b\"\nkind = \"bell\"\nsize = [1, 1, 1]\nposition = [2, 0, 0]\n");
    const Kit kit = written.read();
    const auto young = [&](std::size_t i) {
        double found = 0;
        for (const auto& [name, value] : kit.instruments[i].voice.parameters)
            if (name == "tip_young_pa") found = value;
        return found;
    };
    EXPECT_EQ(young(0), 3e7);
    EXPECT_EQ(young(1), 2e6);
    EXPECT_EQ(kit.mix.gain_db, -4);
    EXPECT_EQ(kit.mix.room.t60_s, 2);
    EXPECT_EQ(kit.mix.room.level_db, -14);  // defaults.toml
}

TEST(Kit, APositiveTiltAboutXTurnsAHeadTowardsThePlayer) {
    const WrittenKit written(kGood);
    const Kit kit = written.read();
    const double angle = 10 * 3.14159265358979323846 / 180;
    // The normal (0, 1, 0) turned about x by the angle.
    EXPECT_TRUE(kit.instruments[0].body.world_from_body.linear().col(1).isApprox(
        Eigen::Vector3d(0, std::cos(angle), std::sin(angle)), 1e-12));
    // 90 degrees about y takes x to -z.
    EXPECT_TRUE(
        kit.instruments[1].body.world_from_body.linear().col(0).isApprox(-Eigen::Vector3d::UnitZ(), 1e-6));
}

TEST(Kit, IncludedInstrumentsFollowAndTheirFilesAreListed) {
    const WrittenKit written("include = [\"bells.toml\"]\n" + instrument(""));
    const Kit kit = written.read();
    EXPECT_EQ(kit.instruments.size(), 9u);
    EXPECT_EQ(kit.instruments[0].name, "a");
    ASSERT_EQ(kit.files.size(), 3u);
    EXPECT_EQ(kit.files[1].filename(), "bells.toml");
    EXPECT_EQ(kit.files[2].filename(), "defaults.toml");
    EXPECT_EQ(kit.stick.radius_m, 0.012);  // of bells.toml, as the kit says nothing
}

TEST(Kit, AKitsOwnDefaultsComeBeforeTheBundledOnes) {
    const WrittenKit written("[defaults.drum]\nrestitution = 0.25\n" + instrument(""));
    EXPECT_EQ(written.read().instruments[0].body.restitution, 0.25);
}

TEST(Kit, AKitThatIsNoFileIsBadInput) {
    EXPECT_THROW((void)read_kit(find_kit("no_such_kit")), BadInput);
    EXPECT_THROW((void)read_kit(::testing::TempDir()), BadInput);
    EXPECT_THROW((void)read_kit(std::string(5000, 'x')), BadInput);
}

TEST(Kit, MalformedKitsEndInBadInputAtThePlace) {
    const std::vector<MalformedKit> cases = {
        {"syntax", "name = ", "1:8", "a syntax error"},
        {"unclosed text", "name = \"a\n", "1:", "a syntax error"},
        {"a key twice", "name = \"a\"\nname = \"b\"\n", "2:", "a syntax error"},
        {"not UTF-8", "name = \"\xff\xfe\"\n", "1:", "a syntax error"},
        {"unknown key", "colour = 1\n" + instrument(""), "1:1", "unknown key \"colour\""},
        {"unknown table", instrument("") + "[drum]\n", "6:2", "unknown key \"drum\""},
        {"no instrument", "name = \"a\"\n", "1:1", "no [[instrument]]"},
        {"instrument no array", "instrument = 3\n", "1:14", "instrument = 3"},
        {"instrument of numbers", "instrument = [3]\n", "1:15", "3 in the kit"},
        {"name missing", "[[instrument]]\nkind = \"drum\"\n", "1:1", "no key \"name\""},
        {"name empty", "[[instrument]]\nname = \"\"\nkind = \"drum\"\n", "2:8", "name = \"\""},
        {"name with a line break", "[[instrument]]\nname = \"a\\nb\"\nkind = \"drum\"\n", "2:8", "\"a?b\""},
        {"name twice", instrument("") + instrument(""), "6:1", "a second instrument \"a\""},
        {"kind missing", "[[instrument]]\nname = \"a\"\n", "1:1", "no key \"kind\""},
        {"kind unknown", "[[instrument]]\nname = \"a\"\nkind = \"gong\"\n", "3:8", "kind = \"gong\""},
        {"size missing", "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nposition = [0, 0, 0]\n", "1:1",
         "no key \"size\""},
        {"position missing", "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1, 1]\n", "1:1",
         "no key \"position\""},
        {"size of two", "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1]\n", "4:8",
         "size with 2 entries"},
        {"size zero", "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 0, 1]\n", "4:12",
         "size[1] = 0"},
        {"size text", "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = \"big\"\n", "4:8",
         "size = \"big\""},
        {"position far",
         "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1, 1]\nposition = [0, 1e9, 0]\n", "5:16",
         "1000000000"},
        {"position nan",
         "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1, 1]\nposition = [0, nan, 0]\n", "5:16",
         "nan"},
        {"unknown key of an instrument", instrument("pitch = 3\n"), "6:1", "unknown key \"pitch\""},
        {"shape", instrument("shape = \"cube\"\n"), "6:9", "shape = \"cube\""},
        {"exponents low", instrument("exponents = [0.05, 1]\n"), "6:14", "exponents[0] = 0.05"},
        {"exponents high", instrument("exponents = [1, 2]\n"), "6:17", "exponents[1] = 2"},
        {"orientation not unit", instrument("orientation = [1, 1, 0, 0]\n"), "6:15",
         "a quaternion of length"},
        {"orientation zero", instrument("orientation = [0, 0, 0, 0]\n"), "6:15", "a quaternion of length 0"},
        {"tilt", instrument("tilt_deg = [1, 2, inf]\n"), "6:19", "inf"},
        {"material key", instrument("material = { yung_pa = 3 }\n"), "6:14", "unknown key \"yung_pa\""},
        {"poisson", instrument("material = { poisson = 0.5 }\n"), "6:24", "poisson = 0.5"},
        {"density negative", instrument("material = { density_kg_m3 = -1 }\n"), "6:30", "density_kg_m3 = -1"},
        {"material number", instrument("material = 3\n"), "6:12", "material = 3"},
        {"visual", instrument("visual = { decay_s = 0 }\n"), "6:22", "decay_s = 0"},
        {"modes", instrument("modes = \"soft\"\n"), "6:9", "modes = \"soft\""},
        {"stand kind", instrument("stand = { kind = \"rope\" }\n"), "6:18", "kind = \"rope\""},
        {"stand axis zero", instrument("stand = { axis = [0, 0, 0] }\n"), "6:18", "axis = [0, 0, 0]"},
        {"stand drawn", instrument("stand = { drawn = 1 }\n"), "6:19", "drawn = 1"},
        {"restitution", instrument("restitution = 1.5\n"), "6:15", "restitution = 1.5"},
        {"zones no array", instrument("zones = { name = \"a\" }\n"), "6:9", "zones = a table"},
        {"zone without name", instrument("zones = [{ radius = [0, 1] }]\n"), "6:10", "no key \"name\""},
        {"zone key", instrument("zones = [{ name = \"a\", r = 1 }]\n"), "6:24", "unknown key \"r\""},
        {"zone turned round", instrument("zones = [{ name = \"a\", radius = [1, 0] }]\n"), "6:33",
         "a zone without radius"},
        {"zone flat", instrument("zones = [{ name = \"a\", height = [1, 1] }]\n"), "6:33",
         "a zone without height"},
        {"midi note", instrument("midi_note = 128\n"), "6:13", "midi_note = 128"},
        {"midi note fraction", instrument("midi_note = 38.5\n"), "6:13", "midi_note = 38.5"},
        {"mesh missing", instrument("mesh = \"no_such.obj\"\n"), "6:8", "no_such.obj"},
        {"mesh name too long", instrument("mesh = \"" + std::string(5000, 'm') + "\"\n"), "6:8",
         "which is no file"},
        {"look part", instrument("look = { skin = { roughness = 1 } }\n"), "6:10", "unknown key \"skin\""},
        {"look colour", instrument("look = { body = { color = [1, 1, 2] } }\n"), "6:34", "color[2] = 2"},
        {"sound text", instrument("sound = { frequency_hz = \"high\" }\n"), "6:26",
         "frequency_hz = \"high\""},
        {"sound instrument", instrument("sound = { instrument = 3 }\n"), "6:24", "instrument = 3"},
        {"pan", instrument("sound = { pan = 2 }\n"), "6:17", "pan = 2"},
        {"choke group", instrument("choke_group = 1\n"), "6:15", "choke_group = 1"},
        {"velocity curve", instrument("velocity_curve = 0\n"), "6:18", "velocity_curve = 0"},
        {"stick modulus", "[stick]\nyoung_pa = 0\n" + instrument(""), "2:12", "young_pa = 0"},
        {"room", "[mix]\nroom_t60_s = -1\n" + instrument(""), "2:14", "room_t60_s = -1"},
        {"stick length", "[stick]\nlength = -1\n" + instrument(""), "2:10", "length = -1"},
        {"stick shaft zero", "[stick]\nshaft = [0, 0, 0]\n" + instrument(""), "2:9", "shaft = [0, 0, 0]"},
        {"stick key", "[stick]\nlenght = 1\n" + instrument(""), "2:1", "unknown key \"lenght\""},
        {"stick number", "stick = 3\n" + instrument(""), "1:9", "stick = 3"},
        {"camera in its target", "[camera]\neye = [1, 1, 1]\ntarget = [1, 1, 1]\n" + instrument(""), "3:10",
         "target at its eye"},
        {"camera angle", "[camera]\nvertical_fov_deg = 180\n" + instrument(""), "2:20",
         "vertical_fov_deg = 180"},
        {"room", "[room]\nfloor_color = [0, 0]\n" + instrument(""), "2:15", "floor_color with 2 entries"},
        {"defaults of no kind", "[defaults.gong]\nmidi_note = 3\n" + instrument(""),
         "1:", "unknown key \"gong\""},
        {"defaults number", "[defaults]\ndrum = 3\n" + instrument(""), "2:8", "drum = 3"},
        {"defaults key", "[defaults.drum]\nhue = 3\n" + instrument(""), "2:1", "unknown key \"hue\""},
        {"include missing", "include = [\"no_such.toml\"]\n" + instrument(""), "1:11", "no_such.toml"},
        {"include a folder", "include = [\".\"]\n" + instrument(""), "1:11", "which is no file"},
        {"include text", "include = \"bells.toml\"\n" + instrument(""), "1:11", "include = \"bells.toml\""},
        {"include too long", "include = [\"" + std::string(5000, 'i') + "\"]\n" + instrument(""), "1:11",
         "which is no file"},
        {"nested too deeply", "a = " + std::string(2000, '[') + std::string(2000, ']') + "\n",
         "1:", "a syntax error"},
    };
    for (const MalformedKit& bad : cases) {
        const WrittenKit written(bad.text);
        try {
            (void)written.read();
            ADD_FAILURE() << bad.what << ": was read";
        } catch (const BadInput& wrong) {
            const std::string message = wrong.what();
            EXPECT_EQ(message.find(written.file().string() + ":" + bad.place), 0u)
                << bad.what << ": " << message;
            EXPECT_NE(message.find("error: found "), std::string::npos) << bad.what << ": " << message;
            EXPECT_NE(message.find(", expected "), std::string::npos) << bad.what << ": " << message;
            EXPECT_NE(message.find(bad.found), std::string::npos) << bad.what << ": " << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << bad.what << ": " << message;
        }
    }
}

TEST(Kit, SixtyFiveInstrumentsAreTooMany) {
    std::string text;
    for (int i = 0; i < 65; ++i)
        text += "[[instrument]]\nname = \"" + std::to_string(i) +
                "\"\nkind = \"bell\"\nsize = [1, 1, 1]\nposition = [0, 0, 0]\n";
    const WrittenKit written(text);
    EXPECT_THROW((void)written.read(), BadInput);
}

TEST(Kit, AKitThatIncludesItselfIsReadOnce) {
    const WrittenKit written(instrument(""));
    const std::string text = "include = [\"" + written.file().filename().string() + "\"]\n" + instrument("");
    std::ofstream(written.file(), std::ios::binary) << text;
    EXPECT_EQ(written.read().instruments.size(), 1u);
}

TEST(Kit, TwoThousandMutatedKitsAreReadOrRefusedInOneLine) {
    std::mt19937 random(20240601);
    constexpr std::string_view kSnippets[] = {"[",
                                              "]",
                                              "{",
                                              "}",
                                              "=",
                                              "\"",
                                              "\n",
                                              "nan",
                                              "-1e308",
                                              "[[instrument]]",
                                              "99999999999999999999",
                                              "\\u0000",
                                              "\x80",
                                              "'",
                                              "0x",
                                              "1979-05-27",
                                              ",",
                                              ".",
                                              "#",
                                              "inf"};
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        std::string text = kGood;
        for (unsigned k = 0; k <= random() % 3; ++k) {
            const std::size_t at = random() % text.size();
            switch (random() % 4) {
                case 0:
                    text[at] = static_cast<char>(random() % 256);
                    break;
                case 1:
                    text.erase(at, 1 + random() % 12);
                    break;
                case 2:
                    text.insert(at, kSnippets[random() % std::size(kSnippets)]);
                    break;
                default:
                    text.insert(at, text.substr(random() % text.size(), random() % 40));
            }
        }
        const WrittenKit written(text);
        try {
            (void)written.read();
        } catch (const BadInput& wrong) {
            ++refused;
            const std::string message = wrong.what();
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_NE(message.find(": error: found "), std::string::npos) << message;
        }
    }
    EXPECT_GT(refused, 500);  // most mutations break the file; some fall into comments and names
}

}  // namespace
}  // namespace app
