#include <audio/samples.h>

#include <cmath>
#include <fstream>

#include "damaged_bytes.h"
#include "files/bad_input.h"
#include "kit/kit_copy.h"
#include "play/audition.h"
#include "temporary_folder.h"
#include "written_kit.h"

namespace app {
namespace {

/// A folder with a kit, an included one and sounds.
class KitFolder {
public:
    KitFolder() {
        std::filesystem::create_directories(folder_.path() / "inner");
        for (const char* name : {"hit.wav", "inner/own.wav"})
            (void)audio::write_wav(folder_.path() / name, std::vector<float>(960, 0.5F));
        text("inner/base.toml", R"(
[[instrument]]
name = "snare"
kind = "drum"
size = [0.36, 0.14, 0.36]
position = [0, 0.7, -0.45]
midi_note = 38
sound = { frequency_hz = 190, snare = 0.8 }

[[instrument]]
name = "tom"
kind = "drum"
size = [0.3, 0.2, 0.3]
position = [0.5, 0.7, -0.45]
sound = { samples = "own.wav" }
)");
    }
    void text(const std::string& name, const std::string& text) const {
        std::ofstream(folder_.path() / name) << text;
    }
    [[nodiscard]] Kit kit(const std::string& text) const {
        this->text("kit.toml", text);
        return read_kit(folder_.path() / "kit.toml");
    }
    [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
        return folder_.path() / name;
    }
    [[nodiscard]] std::string fault(const std::string& text) const {
        try {
            (void)kit(text);
        } catch (const BadInput& wrong) {
            return wrong.what();
        }
        return "";
    }

private:
    TemporaryFolder folder_;
};

bool same_waves(const Instrument& a, const Instrument& b) {
    return std::ranges::equal(a.voice.samples->waves, b.voice.samples->waves,
                              [](const auto& x, const auto& y) { return *x == *y; });
}

const std::string kInclude = "include = [\"inner/base.toml\"]\n";

TEST(IncludedKits, AKeyOfAnInstrumentIsChangedByItsNameAndTheOthersStay) {
    const KitFolder folder;
    const Kit kit =
        folder.kit(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { frequency_hz = 150 }\n");
    ASSERT_EQ(kit.instruments.size(), 2u);
    const Instrument& snare = kit.instruments[0];
    // Those after them are the stick's.
    ASSERT_GE(snare.voice.parameters.size(), 2u);
    EXPECT_EQ(std::vector(snare.voice.parameters.begin(), snare.voice.parameters.begin() + 2),
              (std::vector<std::pair<std::string, double>>{{"frequency_hz", 150}, {"snare", 0.8}}));
    EXPECT_EQ(snare.kind, "drum");
    EXPECT_EQ(snare.body.world_from_body.translation(), Eigen::Vector3d(0, 0.7, -0.45));
}

TEST(IncludedKits, InstrumentsAreLeftOutByRemoveAndMayBeMadeAnew) {
    const KitFolder folder;
    const Kit fewer = folder.kit("remove = [\"tom\"]\n" + kInclude);
    ASSERT_EQ(fewer.instruments.size(), 1u);
    EXPECT_EQ(fewer.instruments[0].name, "snare");
    const Kit anew = folder.kit("remove = [\"tom\"]\n" + kInclude +
                                "[[instrument]]\nname = \"tom\"\nkind = \"cymbal\"\nsize = [0.4, 0.02, 0.4]\n"
                                "position = [0.5, 1, -0.5]\n");
    ASSERT_EQ(anew.instruments.size(), 2u);
    EXPECT_EQ(anew.instruments[0].kind, "cymbal");
    EXPECT_FALSE(anew.instruments[0].voice.samples);
}

TEST(IncludedKits, WhatIsMisspeltOrTwiceIsRefusedWithItsPlace) {
    const KitFolder folder;
    EXPECT_NE(folder.fault("remove = [\"tomm\"]\n" + kInclude)
                  .find("kit.toml:1:11: error: found \"tomm\" in remove, expected the name of an included "
                        "instrument; "
                        "the nearest is tom"),
              std::string::npos);
    EXPECT_NE(folder.fault(kInclude + "[[instrument]]\nname = \"snare\"\n[[instrument]]\nname = \"snare\"\n")
                  .find("no key \"kind\""),
              std::string::npos);
    EXPECT_NE(folder.fault(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { frequency = 150 }\n")
                  .find("unknown key \"frequency\""),
              std::string::npos);
    folder.text("inner/other.toml",
                "[[instrument]]\nname = \"tom\"\nkind = \"drum\"\nsize = [0.3, 0.2, 0.3]\n"
                "position = [0, 0, 0]\n");
    EXPECT_NE(folder.fault("include = [\"inner/base.toml\", \"inner/other.toml\"]\n")
                  .find("a second instrument \"tom\""),
              std::string::npos);
}

TEST(OwnSounds, SamplesLieBesideTheFileThatNamesThem) {
    const KitFolder folder;
    const Kit kit =
        folder.kit(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { samples = \"hit.wav\" }\n");
    ASSERT_TRUE(kit.instruments[0].voice.samples);
    ASSERT_TRUE(kit.instruments[1].voice.samples);
    EXPECT_EQ(kit.instruments[1].voice.samples->waves.size(), 2u);
    EXPECT_EQ(kit.sound_files.size(), 2u);
    EXPECT_NE(folder.fault(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { samples = \"no.wav\" }\n")
                  .find("kit.toml:4:21: error: found samples \"no.wav\", which is no file"),
              std::string::npos);
}

TEST(OwnSounds, AnOwnOrchestraAddsInstruments) {
    const KitFolder folder;
    folder.text("mine.orc",
                ";@ gong frequency_hz 100 20 2000 pitch [Hz]\ninstr gong\naBlow linseg 1, 1 / sr, 0, 1, 0\n"
                "ilevel = 0.1\niduration = 1\naSound reson aBlow, p12, 5\n"
                "amid = aSound\naside = 0 * aSound\niwidth = 0\n$CLOSE\nendin\n");
    const std::string with =
        "[[instrument]]\nname = \"gong\"\nkind = \"cymbal\"\nsize = [0.4, 0.02, 0.4]\n"
        "position = [0, 1, -0.5]\nsound = { orchestra = \"mine.orc\", instrument = \"gong\", ";
    const Kit kit = folder.kit(with + "frequency_hz = 90 }\n");
    EXPECT_EQ(kit.instruments[0].voice.own_orchestra.filename(), "mine.orc");
    EXPECT_NE(folder.fault(with + "pitch = 90 }\n").find("unknown key \"pitch\""), std::string::npos);
    audio::Performance performance(MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc",
                                   {kit.instruments[0].voice});
    performance.schedule({1, 0, 1000, 5, 0, 0, 49, 90});
    const std::vector<float> sound = performance.finish(2000, 48000);
    EXPECT_TRUE(std::all_of(sound.begin(), sound.begin() + 2000, [](float x) { return x == 0; }));
    EXPECT_NE(sound.at(2000), 0);
}

TEST(OwnSounds, AnOrchestraWhoseSoundIsNoNumberIsSaidAndSilencesNobodyElse) {
    const KitFolder folder;
    folder.text("mine.orc",
                ";@ gong frequency_hz 100 20 2000 pitch [Hz]\ninstr gong\n$STROKE(0.4'0'0.01'0.05'1e9)\n"
                "amid = aforce * sqrt(p7 - 100)\naside = 0\niwidth = 0\niduration = 1\n$CLOSE\nendin\n");
    const Kit kit = folder.kit(
        "[[instrument]]\nname = \"gong\"\nkind = \"cymbal\"\nsize = [0.4, 0.02, 0.4]\nposition = [0, 1, "
        "-0.5]\n"
        "sound = { orchestra = \"mine.orc\", instrument = \"gong\", frequency_hz = 90 }\n");
    audio::Performance performance(MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc",
                                   {kit.instruments[0].voice});
    performance.schedule({1, 0, 1000, 5, 0, 0, 49, 90});
    try {
        (void)performance.finish(2000, 48000);
        ADD_FAILURE();
    } catch (const std::runtime_error& wrong) {
        EXPECT_NE(std::string(wrong.what()).find("no numbers from sample "), std::string::npos)
            << wrong.what();
    }
}

TEST(OwnSounds, DamagedKitsAreReadOrRefusedInOneLineWithTheirPlace) {
    const KitFolder folder;
    const std::string good = "remove = [\"tom\"]\n" + kInclude +
                             "[[instrument]]\nname = \"snare\"\nmesh_scale = 0.5\n"
                             "sound = { samples = \"hit.wav\", gain_db = -3, pan = 0.4 }\n";
    std::mt19937 random(17);
    int refused = 0;
    for (int i = 0; i < 300; ++i) {
        const std::vector<std::uint8_t> bad = damaged({good.begin(), good.end()}, random);
        const std::string fault = folder.fault({bad.begin(), bad.end()});
        if (fault.empty()) continue;
        ++refused;
        EXPECT_NE(fault.find("error: found "), std::string::npos) << fault;
        EXPECT_NE(fault.find(", expected "), std::string::npos) << fault;
        EXPECT_NE(fault.find(".toml:"), std::string::npos) << fault;
        EXPECT_EQ(fault.find_first_of("\n\r"), std::string::npos) << fault;
    }
    EXPECT_GT(refused, 100);
}

TEST(KitCopy, ACopyNeedsNothingOfTheOriginalAndKeepsItsText) {
    const KitFolder folder;
    folder.text("inner/drum2.obj", "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.text("inner/set.sfz", "<control> default_path=../\n<region> sample=hit.wav key=38\n");
    const Kit kit = folder.kit("# my kit\n" + kInclude +
                               "[[instrument]]\nname = \"snare\" # changed\nmesh = \"inner/drum2.obj\"\n"
                               "sound = { samples = \"inner/set.sfz\", gain_db = -1 }\n");
    std::filesystem::create_directories(folder / "there");
    copy_kit(kit.file, folder / "there/mine.toml");
    for (const char* name : {"kit.toml", "hit.wav", "inner"}) std::filesystem::remove_all(folder / name);
    const Kit copy = read_kit(folder / "there/mine.toml");
    ASSERT_EQ(copy.instruments.size(), kit.instruments.size());
    EXPECT_TRUE(same_waves(copy.instruments[0], kit.instruments[0]));
    EXPECT_TRUE(same_waves(copy.instruments[1], kit.instruments[1]));
    EXPECT_EQ(copy.instruments[0].mesh.filename(), "drum2.obj");
    std::ifstream stream(copy.file);
    const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    EXPECT_EQ(text,
              "# my kit\ninclude = [\"mine-files/base.toml\"]\n[[instrument]]\nname = \"snare\" # changed\n"
              "mesh = \"mine-files/drum2.obj\"\n"
              "sound = { samples = \"mine-files/set/inner/set.sfz\", gain_db = -1 }\n");
}

TEST(KitCopy, SamplesThatAreLinksAreCopiedUnderTheirNames) {
    const KitFolder folder;
    std::filesystem::create_directories(folder / "set");
    std::filesystem::create_symlink("../hit.wav", folder / "set/a.wav");
    folder.text("set/set.sfz", "<region> sample=a.wav key=38\n");
    const Kit kit =
        folder.kit(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { samples = \"set/set.sfz\" }\n");
    std::filesystem::create_directories(folder / "there");
    copy_kit(kit.file, folder / "there/mine.toml");
    for (const char* name : {"kit.toml", "hit.wav", "inner", "set"})
        std::filesystem::remove_all(folder / name);
    EXPECT_TRUE(same_waves(read_kit(folder / "there/mine.toml").instruments[0], kit.instruments[0]));
}

TEST(KitCopy, ABundledKitAndWhatItIncludesBecomeOnesOwn) {
    const KitFolder folder;
    copy_kit(std::filesystem::path(MUSICWORLD_SOURCE_DIR) / "assets/kits/rock.toml", folder / "mine.toml");
    EXPECT_TRUE(std::filesystem::is_regular_file(folder / "mine-files/drums.toml"));
    EXPECT_EQ(read_kit(folder / "mine.toml").instruments.size(), 10u);
    EXPECT_THROW(copy_kit(folder / "mine.toml", folder / "mine.toml"), BadInput);
}

TEST(KitAudition, EveryZoneIsHeardAtEverySpeedAtItsOnset) {
    const KitFolder folder;
    const Kit kit =
        folder.kit(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { samples = \"hit.wav\" }\n");
    const std::vector<double> speeds = {1, 8};
    const Audition heard = audition(kit, "", speeds);
    ASSERT_EQ(heard.rows.size(), 4u);  // head and rim of two drums
    for (const AuditionRow& row : heard.rows)
        // A wave of 0.5; at 8 m/s as it is, at 1 m/s (velocity 30) (30/127)^2 of it; no pan law is louder than 1.
        EXPECT_NEAR(level_of(heard, row, 1).peak_db - level_of(heard, row, 0).peak_db,
                    40 * std::log10(127.0 / 30), 0.01);
    EXPECT_EQ(audition(kit, "tom", speeds).rows.size(), 2u);
    const std::string sheet = audition_sheet(kit, heard, "sheet.png");
    std::size_t beginnings = 0;
    for (std::size_t at = sheet.find("its first 5 ms"); at != std::string::npos;
         at = sheet.find("its first 5 ms", at + 1), ++beginnings) {
        const std::size_t first = sheet.find("\n0.0000 ", at), last = sheet.find("\n5.0000 ", at);
        ASSERT_LT(last, sheet.find("\ne\n", at));
        EXPECT_EQ(std::count(sheet.begin() + static_cast<std::ptrdiff_t>(first),
                             sheet.begin() + static_cast<std::ptrdiff_t>(last), '\n'),
                  240)
            << "a sample each";
    }
    EXPECT_EQ(beginnings, 8u) << "of each stroke";
    EXPECT_NE(sheet.find(" size 1120,510 "), std::string::npos);
    Audition wide = heard;
    wide.speeds_mps.assign(100, 3);
    EXPECT_NE(audition_sheet(kit, wide, "sheet.png").find(" size 32000,510 "), std::string::npos)
        << "no wider than can be drawn";
    EXPECT_THROW((void)audition(kit, "tim", speeds), BadInput);
}

/// At 1 m/s the bell rings far beyond the 1.5 s after which the next stroke begins.
TEST(Auditions, WhatRingsOnIsNotMeasuredIntoTheNextStroke) {
    const KitFolder folder;
    const Kit kit = folder.kit(R"(
[[instrument]]
name = "bell"
kind = "bell"
size = [0.2, 0.2, 0.2]
position = [0, 1, -0.5]
sound = { decay_s = 20, variation = 0 }
)");
    const Audition first = audition(kit, "", std::vector<double>{8, 1}),
                   alone = audition(kit, "", std::vector<double>{1});
    EXPECT_NEAR(level_of(first, first.rows[0], 1).peak_db, level_of(alone, alone.rows[0], 0).peak_db, 1e-6);
}

TEST(IncludedKits, ParametersOfASoundThatAnotherOneReplacedDoNotCount) {
    const KitFolder folder;
    folder.text("mine.orc", ";@ gong frequency_hz 100 20 2000 pitch\ninstr gong\namid = 0\nendin\n");
    const Kit kit =
        folder.kit(kInclude +
                   "[[instrument]]\nname = \"snare\"\n"
                   "sound = { orchestra = \"mine.orc\", instrument = \"gong\", frequency_hz = 300 }\n");
    EXPECT_EQ(kit.instruments[0].voice.parameters,
              (std::vector<std::pair<std::string, double>>{{"frequency_hz", 300}}));
    const Kit sampled =
        folder.kit(kInclude + "[[instrument]]\nname = \"snare\"\nsound = { samples = \"hit.wav\" }\n");
    EXPECT_TRUE(sampled.instruments[0].voice.samples);
    const Kit back =
        folder.kit(kInclude + "[[instrument]]\nname = \"tom\"\nsound = { samples = \"\", decay_s = 2 }\n");
    EXPECT_FALSE(back.instruments[0].voice.samples);
    const Kit told = folder.kit(kInclude + "[[instrument]]\nname = \"tom\"\nsound = { decay_s = 2 }\n");
    EXPECT_EQ(told.instruments[0].voice.samples->ignored,
              std::vector<std::string>{"decay_s of \"tom\" in the kit"})
        << "which kit check tells";
    const Kit with_pedal = folder.kit(kInclude +
                                      "[[instrument]]\nname = \"tom\"\nsound = { decay_s = 2 }\n"
                                      "pedal = { kind = \"damper\", sound = { decay_s = 0.2 } }\n");
    EXPECT_TRUE(with_pedal.instruments[0].voice.samples->ignored.empty()) << "what rings follows the pedal";
}

/// Two drums of one file: its wave is in memory once.
TEST(OwnSounds, InstrumentsOfOneFileShareItsWaves) {
    const KitFolder folder;
    const Kit kit = folder.kit(
        "include = [\"inner/base.toml\"]\n[[instrument]]\nname = \"snare\"\n"
        "sound = { samples = \"hit.wav\" }\n[[instrument]]\nname = \"tom\"\n"
        "sound = { samples = \"hit.wav\", gain_db = -6 }\n");
    EXPECT_EQ(kit.instruments[0].voice.samples->waves, kit.instruments[1].voice.samples->waves);
}

}  // namespace
}  // namespace app
