// SoundFonts, DrumGizmo's kits, and files of all kinds that were damaged.
#include <cmath>
#include <fstream>
#include <iterator>

#include "audio/own_orchestra.h"
#include "audio/samples.h"
#include "damaged_bytes.h"
#include "region_text.h"
#include "rendering.h"
#include "sample_folder.h"
#include "sample_waves.h"
#include "written_sound_font.h"

namespace {

using namespace rendering;

audio::Note stroke_at(std::uint64_t id, std::int64_t onset, int velocity) {
    return note(id, onset, 8 * std::pow(velocity / 127.0, 1 / 0.7));
}
audio::Voice sampled_file(const std::filesystem::path& file) {
    audio::Voice made = voice("drum", {}, 0);
    made.samples = samples_of(file);
    return made;
}
std::string sound_font() {
    std::vector<std::int16_t> soft(200, 3277), loud(200, 16384);
    for (int i = 0; i < 200; ++i)
        loud[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(16384 - 64 * i);
    return WrittenSoundFont(soft, loud, 48000, 38).bytes();
}
void write_drumgizmo(const SampleFolder& folder) {
    folder.sound("hits.wav", {0.5F, 0.25F, 0.4F, 0.2F}, 2);
    folder.sound("soft.wav", {0.1F, 0.1F, 0.1F, 0.1F}, 2);
    folder.text(
        "snare.xml",
        "<?xml version='1.0'?>\n<instrument version=\"2.0\" name=\"Snare\"><samples>\n"
        "<sample name=\"a\" power=\"0.2\"><audiofile channel=\"OHLeft\" file=\"soft.wav\" filechannel=\"1\"/>"
        "</sample>\n<sample name=\"b\" power=\"1\">\n"
        "<audiofile channel=\"OHLeft\" file=\"hits.wav\" filechannel=\"1\"/>\n"
        "<audiofile channel=\"OHRight\" file=\"hits.wav\" filechannel=\"2\"/>\n"
        "<audiofile channel=\"Room\" file=\"none.wav\" "
        "filechannel=\"1\"/></sample></samples></instrument>\n");
    folder.text(
        "kit.xml",
        "<drumkit name=\"K\"><instruments><instrument name=\"Snare\" file=\"snare.xml\">\n"
        "<channelmap in=\"OHLeft\" out=\"OHLeft\" main=\"true\"/>\n"
        "<channelmap in=\"OHRight\" out=\"OHRight\" main=\"true\"/></instrument></instruments></drumkit>\n");
    folder.text("midimap.xml", "<midimap><map note=\"38\" instr=\"Snare\"/></midimap>\n");
}

TEST(SoundFont, LayersOfTheDrumPresetAreHeardFromTheOnset) {
    const SampleFolder folder;
    const auto file = folder.text("one.sf2", sound_font());
    const auto sound = left(render({sampled_file(file)}, {stroke_at(1, 1001, 127), stroke_at(2, 3003, 40)}));
    EXPECT_EQ(sound.at(1000), 0);
    for (int i = 0; i < 200; ++i)
        ASSERT_EQ(sound.at(1001 + static_cast<std::size_t>(i)), (16384 - 64 * i) / 32768.0);
    EXPECT_NEAR(sound.at(3003), 3277 / 32768.0 * 40 * 40 / 127 / 127, 1e-8);
    EXPECT_NE(fault_of(file, {40})
                  .find("no sound for MIDI note 40, expected a zone's midi_note among its keys, 38 to 38"),
              std::string::npos);
}

/// Of the loud layer the key range becomes the sample mode, a loop, and the velocity range the release, of 1 s: by 100 dB.
TEST(SoundFont, ALoopGoesOnThroughTheRelease) {
    const SampleFolder folder;
    std::string font = sound_font();
    const std::size_t zone = font.find("igen") + 8 + 3 * 4;
    font.replace(zone, 8, std::string("\x36\0\1\0\x26\0\0\0", 8));
    const auto sound = left(render({sampled_file(folder.text("loop.sf2", font))}, {stroke_at(1, 1000, 127)}));
    for (int i = 0; i < 600; ++i) {
        const double level = (16384 - 64 * (i % 200)) / 32768.0;
        ASSERT_NEAR(sound.at(1000 + static_cast<std::size_t>(i)),
                    i < 200 ? level : level * std::pow(10, -5 * (i - 200) / 48000.0), 1e-6)
            << i;
    }
}

TEST(DrumGizmo, MainChannelsOfTheMappedInstrumentAreHeardInTheirPlaces) {
    const SampleFolder folder;
    write_drumgizmo(folder);
    audio::Voice snare = sampled_file(folder / "kit.xml");
    snare.pan = 0.5;
    const auto sound = render({snare}, {stroke_at(1, 100, 127), stroke_at(2, 2000, 10)});
    const double centre = std::sqrt(0.5);
    EXPECT_NEAR(sound.at(200), 0.5 * centre, 1e-7);   // left: the first channel
    EXPECT_NEAR(sound.at(201), 0.25 * centre, 1e-7);  // right: the second
    EXPECT_NEAR(sound.at(4000), 0.1 * centre, 1e-7);
    EXPECT_EQ(sound.at(4001), 0);
    folder.text("midimap.xml", "<midimap>\n <map note=\"38\" instr=\"Tom\"/></midimap>\n");
    EXPECT_NE(fault_of(folder / "kit.xml").find("midimap.xml:2:3: error: found instr=\"Tom\""),
              std::string::npos)
        << fault_of(folder / "kit.xml");
}

/// Reads a file's damaged copies; each reads, or is refused in one line with its place. Gives how many were refused.
int refusals_of(const SampleFolder& folder, const std::string& name, const std::string& read_by, int copies) {
    std::ifstream stream(folder / name, std::ios::binary);
    const std::vector<std::uint8_t> good{std::istreambuf_iterator<char>(stream),
                                         std::istreambuf_iterator<char>()};
    std::mt19937 random(static_cast<unsigned>(name.size() + 7 * name.back()));
    int refused = 0;
    for (int i = 0; i < copies; ++i) {
        const std::vector<std::uint8_t> bad = damaged(good, random);
        folder.text(name, {bad.begin(), bad.end()});
        const std::string fault = fault_of(folder / read_by);
        if (fault.empty()) continue;
        ++refused;
        EXPECT_NE(fault.find("error: found "), std::string::npos) << fault;
        EXPECT_NE(fault.find(", expected "), std::string::npos) << fault;
        EXPECT_EQ(fault.find_first_of("\n\r"), std::string::npos) << fault;
        EXPECT_EQ(fault.find((folder / "").string()), 0u) << fault;
    }
    folder.text(name, {good.begin(), good.end()});
    return refused;
}

TEST(DamagedSamples, AreReadOrRefusedWithTheirPlace) {
    const SampleFolder folder;
    std::vector<float> wave;
    for (int i = 0; i < 400; ++i) wave.push_back(0.5F - static_cast<float>(i % 97) / 256);
    folder.sound("a.wav", wave), folder.sound("a.flac", wave);
    folder.text("a.sfz",
                "#define $K 38\n<control> default_path=./\n<group> key=$K seq_length=2 ampeg_attack=0.01\n"
                "<region> sample=a.wav hivel=90 seq_position=1 tune=-5\n<region> sample=a.flac lovel=3 "
                "seq_position=2\n");
    folder.text("a.sf2", sound_font());
    write_drumgizmo(folder);
    int refused = 0;
    for (const auto& [name, read_by] : {std::pair("a.wav", "a.wav"),
                                        {"a.flac", "a.flac"},
                                        {"a.sfz", "a.sfz"},
                                        {"a.wav", "a.sfz"},
                                        {"a.sf2", "a.sf2"},
                                        {"kit.xml", "kit.xml"},
                                        {"snare.xml", "kit.xml"},
                                        {"midimap.xml", "kit.xml"}})
        refused += refusals_of(folder, name, read_by, 60);
    EXPECT_GT(refused, 100);
}

TEST(DamagedSamples, LimitsAreKept) {
    const SampleFolder folder;
    folder.sound("long.wav", std::vector<float>(301 * 1000, 0.1F), 1, 1000);
    EXPECT_NE(fault_of(folder / "long.wav").find("found \""), std::string::npos);
    EXPECT_NE(fault_of(folder / "long.wav").find("expected 1 to 300 s"), std::string::npos);
    folder.sound("loud.wav", {0.1F, std::nanf("")});
    EXPECT_NE(fault_of(folder / "loud.wav").find("samples that are no numbers"), std::string::npos);
    // What counts of a tuned sample is its length before tuning, which takes the time.
    audio::Recording recording;
    recording.rate_hz = 48000;
    recording.channels = {std::vector<float>(48000, 0.1F)};
    audio::WrittenRegion region;
    region.tune = 9500, region.pitch_keytrack = 0;
    const audio::Wave wave = audio::make_wave(region, recording, 0, 38);
    EXPECT_EQ(wave.cut_frames, 48000U);
    EXPECT_LT(wave.samples.size(), 1000U);
    std::string regions = "<global> key=38 sample=a.wav\n";
    for (int i = 0; i < 4097; ++i) regions += "<region>\n";
    folder.sound("a.wav", {0.1F});
    EXPECT_NE(fault_of(folder.text("many.sfz", regions)).find("more than 4096 regions"), std::string::npos);
    EXPECT_NE(fault_of(folder.text("big.sfz", std::string(audio::kLargestRegionFile + 1, ' ')))
                  .find("more than 4 MiB"),
              std::string::npos);
}

}  // namespace
