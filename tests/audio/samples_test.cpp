#include "audio/samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rendering.h"
#include "sample_folder.h"

namespace {

using namespace rendering;

/// A ramp whose every value is told from the next, exact in 24 bits.
std::vector<float> ramp(int length, float first = 0.5F) {
    std::vector<float> samples;
    for (int i = 0; i < length; ++i) samples.push_back(first - static_cast<float>(i) / 65536);
    return samples;
}
audio::Voice sampled(const std::filesystem::path& file, double pan = 0, const std::string& group = "") {
    audio::Voice made = voice("drum", {}, pan, group);
    made.samples = samples_of(file);
    return made;
}
audio::Note stroke(std::uint64_t id, std::int64_t onset, int velocity = 127) {
    audio::Note made = note(id, onset);
    made.speed_mps = 8 * std::pow(velocity / 127.0, 1 / 0.7);
    return made;
}

TEST(Samples, ASoundIsHeardSampleBySampleFromItsOnsetAtEveryPhaseOfTheBlock) {
    const SampleFolder folder;
    const std::vector<float> wave = ramp(300);
    for (const char* name : {"a.wav", "a.flac"}) {
        const auto file = folder.sound(name, wave);
        std::vector<audio::Note> notes;
        for (int i = 0; i < 65; ++i)
            notes.push_back(stroke(static_cast<std::uint64_t>(i + 1), 100 + 401 * i));
        const auto sound = left(render({sampled(file)}, notes));
        for (const audio::Note& each : notes)
            for (int i = 0; i < 401; ++i) {
                const auto at = static_cast<std::size_t>(each.onset_sample + i);
                if (at >= sound.size()) break;
                ASSERT_EQ(sound[at], i < 300 ? wave[static_cast<std::size_t>(i)] : 0) << name << " " << at;
            }
        EXPECT_TRUE(std::all_of(sound.begin(), sound.begin() + 100, [](double x) { return x == 0; }));
    }
}

TEST(Samples, BothChannelsStayApart) {
    const SampleFolder folder;
    const auto file = folder.sound("stereo.wav", {0.5F, -0.25F, 0.125F, 0.0625F}, 2);
    const auto sound = render({sampled(file, 0.5)}, {stroke(1, 10)});
    // Constant power: each side 1/sqrt 2 in the middle; floats to 2^-25.
    EXPECT_NEAR(sound.at(20), 0.5 * std::numbers::sqrt2 / 2, 3e-8);
    EXPECT_NEAR(sound.at(21), -0.25 * std::numbers::sqrt2 / 2, 3e-8);
    EXPECT_NEAR(sound.at(23), 0.0625 * std::numbers::sqrt2 / 2, 3e-8);
}

TEST(Samples, OtherRatesAreResampledInPlaceAndInPitch) {
    const SampleFolder folder;
    for (const int rate : {22050, 44100, 96000}) {
        std::vector<float> wave;
        for (int i = 0; i < rate; ++i)
            wave.push_back(0.5F * static_cast<float>(std::sin(2 * std::numbers::pi * 1000 * i / rate)));
        const auto sound = left(render({sampled(folder.sound("sine.wav", wave, 1, rate))}, {stroke(1, 0)}));
        // In the middle, away from the ends of the file: a sine of the same phase within the converter's -97 dB and the
        // samples' float.
        for (std::size_t i = 12000; i < 36000; ++i)
            ASSERT_NEAR(sound[i],
                        0.5 * std::sin(2 * std::numbers::pi * 1000 * static_cast<double>(i) / 48000), 2e-4)
                << rate << " at " << i;
    }
}

TEST(Samples, VelocityChoosesTheLayerAndStrokesTakeTurns) {
    const SampleFolder folder;
    for (const auto& [name, value] : {std::pair("soft.wav", 0.1F), {"one.wav", 0.2F}, {"two.wav", 0.3F}})
        folder.sound(name, std::vector<float>(8, value));
    const auto file =
        folder.text("kit.sfz",
                    "// layers\n<control> default_path=./\n<global> amp_veltrack=0 key=d2\n"
                    "<region> sample=soft.wav hivel=63\n<group> lovel=64 seq_length=2\n"
                    "<region> sample=one.wav seq_position=1\n<region> sample=two.wav seq_position=2 "
                    "volume=6.0206\n");
    const auto sound = left(render({sampled(file)}, {stroke(1, 0, 100), stroke(2, 1000, 20),
                                                     stroke(3, 2000, 64), stroke(4, 3000, 127)}));
    EXPECT_FLOAT_EQ(static_cast<float>(sound.at(0)), 0.2F);
    EXPECT_FLOAT_EQ(static_cast<float>(sound.at(1000)), 0.1F);
    EXPECT_NEAR(sound.at(2000), 0.6, 1e-5);  // 6.0206 dB is 2 to five digits
    EXPECT_FLOAT_EQ(static_cast<float>(sound.at(3000)), 0.2F);
}

TEST(Samples, AStrokeOf8MetresASecondHasVelocity127AndTheCurveIsThatOfMidi) {
    EXPECT_EQ(audio::stroke_velocity(8), 127);
    EXPECT_EQ(audio::stroke_velocity(30), 127);
    EXPECT_EQ(audio::stroke_velocity(2), 48);  // 127 * 0.25^0.7 = 48.12
    EXPECT_EQ(audio::stroke_velocity(0.001), 1);
}

TEST(Samples, GainFollowsTheSquareOfVelocity) {
    const SampleFolder folder;
    const auto file = folder.sound("a.wav", std::vector<float>(8, 0.5F));
    for (const int velocity : {1, 30, 90, 127})
        EXPECT_NEAR(left(render({sampled(file)}, {stroke(1, 5, velocity)}, 64)).at(5),
                    0.5 * velocity * velocity / 16129.0, 3e-8);
}

TEST(Samples, ACancelledStrokeLeavesNoTraceNotEvenInTheRoundRobin) {
    const SampleFolder folder;
    folder.sound("one.wav", ramp(500, 0.2F));
    folder.sound("two.wav", ramp(500, 0.4F));
    const auto file = folder.text("kit.sfz",
                                  "<group> key=38 seq_length=2\n<region> sample=one.wav\n"
                                  "<region> sample=two.wav seq_position=2\n");
    const std::vector<audio::Voice> voices = {sampled(file)};
    const auto without = render(voices, {stroke(1, 100), stroke(3, 5000), stroke(4, 9000)});
    audio::Performance performance(kOrchestra, voices);
    for (const auto& each : {stroke(1, 100), stroke(2, 3000), stroke(3, 5000)}) performance.schedule(each);
    performance.advance_to(1000);
    performance.cancel(2);
    performance.schedule(stroke(4, 9000));
    EXPECT_EQ(performance.finish(0, kLongTail), without);
}

TEST(Samples, AChokedSampleFadesWithoutAClickAndEndsAtZero) {
    const SampleFolder folder;
    const auto open = folder.sound("open.wav", std::vector<float>(96000, 0.5F)),
               closed = folder.sound("closed.wav", std::vector<float>(1, 0.0F));
    const auto sound = left(render({sampled(open, 0, "hat"), sampled(closed, 0, "hat")},
                                   {stroke(1, 100), note(2, 20011, 3, 1)}, 48000, 0));
    for (std::size_t i = 100; i < 20011; ++i) ASSERT_EQ(sound[i], 0.5) << i;
    for (std::size_t i = 20011; i < 48000; ++i)  // 3t^2 - 2t^3 over 720 samples: steepest 1.5 / 720
        ASSERT_LE(std::abs(sound[i] - sound[i - 1]), 0.5 * 1.5 / 720 * 1.01) << i;
    EXPECT_EQ(sound.at(20011 + 720 + 64), 0);
}

TEST(Mix, AloneEachNoteAddsUpToTheMixInTheRoomWithChokesAndTurns) {
    const SampleFolder folder;
    for (const auto& [name, value] : {std::pair("one.wav", 0.2F), {"two.wav", 0.3F}})
        folder.sound(name, std::vector<float>(4800, value));
    const std::vector<audio::Voice> voices{
        sampled(folder.text("turns.sfz",
                            "<region> sample=one.wav seq_length=2 seq_position=1\n"
                            "<region> sample=two.wav seq_length=2 seq_position=2\n"),
                0.3, "hat"),
        voice("bell", {{"decay_s", 1}}, 0.7, "hat")};
    const std::vector<audio::Note> notes{note(1, 100), note(2, 2000, 5, 1), note(3, 2030), note(4, 9000, 2)};
    audio::Mix mix{.gain_db = 3, .room = {.t60_s = 0.4, .level_db = -10}};
    const auto played = [&](std::optional<std::uint64_t> alone) {
        mix.alone_note = alone;
        audio::Performance performance(kOrchestra, voices, mix);
        for (const audio::Note& each : notes) performance.schedule(each);
        return performance.finish(24000, 0);
    };
    const std::vector<float> all = played({});
    std::vector<double> sum(all.size(), 0.0);
    for (const audio::Note& each : notes) {
        const std::vector<float> alone = played(each.id);
        EXPECT_TRUE(std::ranges::any_of(alone, [](float x) { return x != 0; })) << each.id;
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += alone[i];
    }
    // Roundings to float of some ten values below 1, of the notes and of the room's lines.
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_NEAR(all[i], sum[i], 1e-6) << i;
}

TEST(Samples, LiveSoundsAsOffline) {
    const SampleFolder folder;
    folder.sound("one.wav", ramp(3000, 0.2F), 1, 44100);
    folder.sound("two.wav", ramp(3000, 0.4F));
    const auto file = folder.text("kit.sfz",
                                  "<group> key=38 seq_length=2\n<region> sample=one.wav\n"
                                  "<region> sample=two.wav seq_position=2 tune=50\n");
    const std::vector<audio::Voice> voices = {sampled(file), voice("drum")};
    const std::vector<audio::Note> notes = {stroke(1, 777), stroke(2, 4001), note(3, 4100, 3, 1),
                                            stroke(4, 9000)};
    const auto offline = render(voices, notes, 24000, 0);
    Kept kept;
    audio::LivePerformance live(kOrchestra, voices, kept.with({.longest_s = 3}));
    for (const auto& each : notes) ASSERT_TRUE(live.schedule(each));
    EXPECT_EQ(kept.finish(live, 24000, 0), offline);
}

TEST(Sfz, TuningOffsetEndEnvelopeAndPanAreInTheSound) {
    const SampleFolder folder;
    folder.sound("a.wav", ramp(1000));
    const auto value = [&](const std::string& opcodes, std::size_t at, bool right = false) {
        const auto file = folder.text("one.sfz", "<region> sample=a.wav key=38 " + opcodes);
        const auto sound = render({sampled(file, 0.5)}, {stroke(1, 0)});
        return at < sound.size() / 2 ? sound[2 * at + (right ? 1 : 0)] * std::numbers::sqrt2 : 0.0;
    };
    const auto at = [](int i) { return 0.5 - i / 65536.0; };
    EXPECT_NEAR(value("offset=100", 0), at(100), 1e-7);
    EXPECT_NEAR(value("end=9", 9), at(9), 1e-7);
    EXPECT_EQ(value("end=9", 10), 0);
    EXPECT_NEAR(value("delay=0.001", 48), at(0), 1e-7);
    EXPECT_NEAR(value("ampeg_attack=0.01", 240), 0.5 * at(240), 1e-7);
    EXPECT_NEAR(value("ampeg_decay=0.01 ampeg_sustain=50", 700), 0.5 * at(700), 1e-7);
    EXPECT_NEAR(value("pan=-100", 0), std::numbers::sqrt2 * at(0), 1e-7);
    EXPECT_NEAR(value("pan=-100", 0, true), 0, 1e-7);
    EXPECT_NEAR(value("pitch_keycenter=26", 100), at(200), 2e-3);  // an octave up; the file's edges ring
}

TEST(Sfz, DefinesIncludesCommentsAndTriggersAreFollowed) {
    const SampleFolder folder;
    folder.sound("a b.wav", ramp(10));
    folder.text("inner.txt", "<region> sample=$NAME.wav key=$KEY\n");
    const auto file =
        folder.text("outer.sfz",
                    "#define $KEY 38\n#define $NAME a b\n/* two\nlines */ <group> trigger=release\n"
                    "<region> sample=none.wav key=38 // not sounded\n<group>\n#include \"inner.txt\"\n");
    const auto set = samples_of(file);
    EXPECT_EQ(set->regions.size(), 1u);
    EXPECT_EQ(set->files.size(), 3u);
}

TEST(Sfz, AZoneWithoutASoundOfItsOwnSoundsAsTheFirst) {
    const SampleFolder folder;
    folder.sound("a.wav", ramp(10));
    const auto file = folder.text("one.sfz", "<region> sample=a.wav key=38");
    audio::Voice made = voice("drum", {}, 0);
    made.samples = samples_of(file, {38, 37});
    audio::Note rim = stroke(1, 100);
    rim.midi_note = 37;
    EXPECT_EQ(left(render({made}, {rim})).at(100), 0.5);
}

TEST(Sfz, FaultsNameTheirPlace) {
    const SampleFolder folder;
    folder.sound("a.wav", ramp(10));
    const auto fault = [&](const std::string& text) { return fault_of(folder.text("bad.sfz", text)); };
    const auto expect = [&](const std::string& text, const std::string& part) {
        EXPECT_NE(fault(text).find(part), std::string::npos) << fault(text);
    };
    expect("<region>\n sample=b.wav", "bad.sfz:2:2: error: found sample ");
    expect("<region> sample=a.wav lovel=200",
           "bad.sfz:1:23: error: found lovel=200, expected a number from 0 to 127");
    expect("<region> sample=a.wav key=h7", "found key=h7, expected a key from 0 to 127");
    expect("<region> key=38", "bad.sfz:1:1: error: found a <region> without sample");
    expect("<region> sample=a.wav offset=10", "found offset 10 of a sample that ends at frame 10");
    expect("<region> sample=a.wav key=40",
           "found no sound for MIDI note 38, expected a zone's midi_note among its keys, 40");
    expect("<region sample=a.wav", "<header>");
    expect("hello", "expected <header> or opcode=value");
    expect("#include \"bad.sfz\"", "at most 8 within each other");
    expect("<region> sample=$X", "a name that #define gave a value");
    expect("", "no <region> that a stroke sounds");
    EXPECT_NE(fault_of(folder.text("bad.wav", "RIFF....")).find("libsndfile reads"), std::string::npos);
    EXPECT_NE(fault_of(folder / "none.wav").find("which is no file"), std::string::npos);
}

/// Frames 20 to 29 of the file are heard again and again, for the 10 ms that the envelope holds.
TEST(Samples, ALoopIsHeardUntilTheEnvelopeHasDecayed) {
    const SampleFolder folder;
    folder.sound("a.wav", ramp(100));
    const auto set =
        samples_of(folder.text("a.sfz",
                               "<region> sample=a.wav key=38 loop_mode=loop_continuous loop_start=20 "
                               "loop_end=29 ampeg_hold=0.01 ampeg_decay=0.0001 ampeg_sustain=0"));
    const std::vector<float>& wave = *set->waves.at(0);
    ASSERT_GE(set->regions.at(0).frames, 480U);  // 10 ms
    EXPECT_LE(set->regions.at(0).frames, 490U);
    const std::vector<float> file = ramp(100);
    for (std::size_t i = 0; i < 480; ++i) ASSERT_EQ(wave[i], file[i < 30 ? i : 20 + (i - 20) % 10]) << i;
}

/// A WAV file's own loop (frames 20 to 29 of its chunk `smpl`) is followed in SFZ, where nothing else is said; alone it is the sound as it is.
TEST(Samples, TheLoopOfAWavFileIsFollowedInSfz) {
    const SampleFolder folder;
    SF_INFO info{};
    info.channels = 1, info.samplerate = 48000, info.format = SF_FORMAT_WAV | SF_FORMAT_FLOAT;
    SNDFILE* file = sf_open((folder / "a.wav").c_str(), SFM_WRITE, &info);
    SF_INSTRUMENT instrument{};
    instrument.gain = 1, instrument.loop_count = 1;
    instrument.loops[0] = {SF_LOOP_FORWARD, 20, 30, 0};
    ASSERT_EQ(sf_command(file, SFC_SET_INSTRUMENT, &instrument, sizeof instrument), SF_TRUE);
    const std::vector<float> wave = ramp(100);
    sf_writef_float(file, wave.data(), 100);
    sf_close(file);
    const std::string decay =
        "<region> sample=a.wav key=38 ampeg_hold=0.01 ampeg_decay=0.0001 ampeg_sustain=0";
    const auto looped = samples_of(folder.text("a.sfz", decay));
    for (std::size_t i = 0; i < 480; ++i)
        ASSERT_EQ((*looped->waves.at(0))[i], wave[i < 30 ? i : 20 + (i - 20) % 10]) << i;
    EXPECT_EQ(samples_of(folder.text("b.sfz", decay + " loop_mode=no_loop"))->regions.at(0).frames, 100U);
    EXPECT_EQ(samples_of(folder / "a.wav")->regions.at(0).frames, 100U);
}

/// The key is let go when the loop was heard once: 30 frames. Then by 80 dB in 480 frames, or on to the end.
TEST(Samples, AfterTheReleaseALoopOfLoopSustainGoesOnToTheEnd) {
    const SampleFolder folder;
    folder.sound("a.wav", std::vector<float>(1000, 0.5F));
    for (const auto& [mode, frames] : {std::pair("loop_continuous", 30 + 480), {"loop_sustain", 30 + 480}}) {
        const auto set = samples_of(
            folder.text("a.sfz", std::string("<region> sample=a.wav key=38 loop_start=20 loop_end=29 "
                                             "ampeg_release=0.01 loop_mode=") +
                                     mode));
        const std::vector<float>& wave = *set->waves.at(0);
        EXPECT_NEAR(set->regions.at(0).frames, frames, 2) << mode;  // rounded up, and one more
        EXPECT_FLOAT_EQ(wave[29], 0.5F);
        EXPECT_NEAR(wave[30 + 240], 0.5e-2, 1e-4) << "-40 dB half way";
    }
    folder.sound("b.wav", ramp(100));
    const auto set = samples_of(folder.text(
        "b.sfz",
        "<region> sample=b.wav key=38 loop_start=20 loop_end=29 ampeg_release=100 loop_mode=loop_sustain"));
    EXPECT_EQ(set->regions.at(0).frames, 100U) << "once through, then to the end";
}

TEST(Samples, AKeyswitchChoosesItsRegions) {
    const SampleFolder folder;
    for (const auto& [name, value] : {std::pair("one.wav", 0.1F), {"two.wav", 0.2F}, {"any.wav", 0.3F}})
        folder.sound(name, std::vector<float>(8, value));
    const std::string regions =
        "<region> sample=one.wav key=38 sw_last=24\n<region> sample=two.wav key=38 sw_last=c#1\n"
        "<region> sample=any.wav key=38\n<region> sample=any.wav key=38 sw_down=24\n";
    const auto heard = [&](const std::string& text, std::optional<int> down) {
        audio::SampleLibrary library;
        std::vector<float> values;
        const auto set = audio::read_samples(folder.text("a.sfz", text), std::vector{38}, library, down);
        for (const auto& wave : set->waves) values.push_back(wave->front());
        return values;
    };
    EXPECT_EQ(heard(regions, {}), (std::vector<float>{0.1F, 0.3F})) << "the lowest";
    EXPECT_EQ(heard("<global> sw_default=25\n" + regions, {}), (std::vector<float>{0.2F, 0.3F}));
    EXPECT_EQ(heard("<global> sw_default=25\n" + regions, 24), (std::vector<float>{0.1F, 0.3F}));
    EXPECT_THROW((void)heard(regions, 26), audio::SampleError);
}

}  // namespace
