#include "audio/orchestra.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "rendering.h"

namespace {

using namespace rendering;

std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

/// An orchestra file of a test's own, in the host's form.
class OwnOrchestra : public testing::Test {
protected:
    void TearDown() override { std::filesystem::remove(file_); }
    std::filesystem::path write(const std::string& instrument,
                                const std::string& format = "sr = 48000\nksmps = 64\n") {
        std::ofstream(file_)
            << format << "nchnls = 2\n0dbfs = 1\n"
            << "gi1 ftgen 901, 0, -4, -2, 0\ngi2 ftgen 902, 0, -1, -2, 0\n;@ one level 1 0 2 gain\n"
            << instrument;
        return file_;
    }
    const std::filesystem::path file_ =
        std::filesystem::temp_directory_path() /
        ("musicworld_orchestra_" + std::to_string(std::random_device{}()) + ".orc");
};

TEST(Orchestra, TheShippedFileDeclaresTheInstrumentsOfTheseTestsWithParametersWithinTheirRanges) {
    const auto instruments = audio::read_instruments(kOrchestra);
    ASSERT_EQ(instruments.size(), kInstruments.size());
    for (std::size_t i = 0; i < kInstruments.size(); ++i) {
        EXPECT_EQ(instruments[i].name, kInstruments[i]);
        for (const auto& parameter : instruments[i].parameters) {
            EXPECT_LE(parameter.minimum, parameter.fallback);
            EXPECT_LE(parameter.fallback, parameter.maximum);
            EXPECT_FALSE(parameter.text.empty()) << parameter.name;
        }
        EXPECT_EQ(instruments[i].parameters.at(0).name, "frequency_hz");
    }
}

TEST(Orchestra, EachInstrumentSoundsFiniteAtBothEndsOfEveryParameter) {
    for (const auto& instrument : audio::read_instruments(kOrchestra)) {
        std::vector<audio::Voice> voices;
        std::vector<audio::Note> notes;
        for (const auto& parameter : instrument.parameters) {
            for (const double value : {parameter.minimum, parameter.maximum}) {
                const auto id = static_cast<std::uint32_t>(voices.size());
                voices.push_back(voice(instrument.name, {{parameter.name, value}}, 0));
                notes.push_back(note(id + 1, 4800LL * id, 8, id));
            }
        }
        const auto sound = left(render(voices, notes, 0, 4800LL * std::ssize(notes) + 48000));
        for (const auto& each : notes) {
            double peak = 0;
            for (std::int64_t i = each.onset_sample; i < each.onset_sample + 4800; ++i) {
                const double x = sound.at(static_cast<std::size_t>(i));
                ASSERT_TRUE(std::isfinite(x));
                peak = std::max(peak, std::abs(x));
            }
            EXPECT_GT(peak, 0.05) << instrument.name << " " << voices[each.voice].parameters[0].first;
            EXPECT_LT(peak, 4) << instrument.name << " " << voices[each.voice].parameters[0].first;
        }
    }
}

TEST(Orchestra, UnknownInstrumentNamesTheKnownOnes) {
    const std::string message = error_of([] { audio::Performance(kOrchestra, {voice("gong")}); });
    EXPECT_NE(message.find("`gong`"), message.npos) << message;
    EXPECT_NE(message.find("drum, bell, string, cymbal"), message.npos) << message;
}

TEST(Orchestra, UnknownRepeatedOrOutOfRangeParametersAreRuntimeErrorsThatSayWhatIsExpected) {
    const auto message = error_of([] { audio::Performance(kOrchestra, {voice("bell", {{"pitch", 3}})}); });
    EXPECT_NE(message.find("`pitch`"), message.npos) << message;
    EXPECT_NE(message.find("frequency_hz, decay_s"), message.npos) << message;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Parameters& bad : {Parameters{{"decay_s", 1}, {"decay_s", 1}}, Parameters{{"decay_s", -1}},
                                  Parameters{{"decay_s", nan}}, Parameters{{"decay_s", 1e9}}}) {
        EXPECT_THROW(audio::Performance(kOrchestra, {voice("bell", bad)}), std::runtime_error);
    }
}

TEST(Orchestra, PanOrGainOutOfRangeIsARuntimeError) {
    audio::Voice loud = voice("bell");
    loud.gain_db = std::numeric_limits<double>::infinity();
    EXPECT_THROW(audio::Performance(kOrchestra, {loud}), std::runtime_error);
    EXPECT_THROW(audio::Performance(kOrchestra, {voice("bell", {}, 1.01)}), std::runtime_error);
}

TEST(Orchestra, AMissingFileIsARuntimeErrorWithItsName) {
    const std::string message = error_of([] { audio::Performance("no/such.orc", {}); });
    EXPECT_NE(message.find("no/such.orc"), message.npos);
}

TEST_F(OwnOrchestra, AFileThatDoesNotCompileIsARuntimeErrorWithCsoundsMessage) {
    const auto file = write("instr one\n a1 nosuchopcode 3\nendin\n");
    const std::string message = error_of([&] { audio::Performance(file, {}); });
    EXPECT_NE(message.find(file.string()), message.npos) << message;
    EXPECT_NE(message.find("nosuchopcode"), message.npos) << message;
}

TEST_F(OwnOrchestra, AnotherSampleRateIsARuntimeError) {
    const auto file = write("instr one\nendin\n", "sr = 44100\nksmps = 64\n");
    const std::string message = error_of([&] { audio::Performance(file, {}); });
    EXPECT_NE(message.find("44100"), message.npos) << message;
}

TEST_F(OwnOrchestra, ADeclaredInstrumentWithoutItsInstrIsARuntimeError) {
    const auto file = write("instr two\nendin\n");
    EXPECT_THROW(audio::Performance(file, {voice("one")}), std::runtime_error);
}

TEST_F(OwnOrchestra, ParametersArriveFromP12OnAndNotesFromP4) {
    const auto file = write(
        "instr one\n p3 = 0.1\n a1 linseg p12 + p7 / 100, 1, p12 + p7 / 100\n outs a1 * p5, a1 * "
        "p6\nendin\n");
    audio::Performance performance(file, {voice("one", {{"level", 0.5}}, 0)});
    performance.schedule(note(1, 100, 7));
    EXPECT_FLOAT_EQ(performance.finish(1000, 0).at(2 * 100), 0.57F);
}

TEST_F(OwnOrchestra, AnInstrumentThatFailsIsReportedByFinishAndTheProgramGoesOn) {
    const auto file = write("instr one\n p3 = 1\n a1 oscil 1, 440, 999\n outs a1, a1\nendin\n");
    audio::Performance performance(file, {voice("one")});
    performance.schedule(note(1, 100));
    EXPECT_THROW(
        {
            for (int i = 1; i < 1000; ++i)
                performance.advance_to(64 * i);  // more commands than the queue holds
            (void)performance.finish(48000, 0);
        },
        std::runtime_error);
}

TEST(OrchestraParser, BadLinesAreReportedWithFileAndLine) {
    const auto parse = [](const char* text) {
        return error_of([=] { (void)audio::parse_instruments(text, "x.orc"); });
    };
    EXPECT_EQ(parse("sr = 1\n;@ drum\n").find("x.orc:2:1: error: found parameter ``, expected"), 0U);
    EXPECT_EQ(parse(";@ 1drum a 1 0 2\n").find("x.orc:1:1: error: found instrument `1drum`"), 0U);
    EXPECT_EQ(parse(";@ drum a 1 0\n").find("x.orc:1:1: error: found too few words, expected `;@ "), 0U);
    EXPECT_EQ(parse(";@ drum a 1 0 inf\n").find("x.orc:1:1: error: found `inf`"), 0U);
    EXPECT_EQ(parse(";@ drum a 3 0 2\n").find("x.orc:1:1: error: found default outside its range"), 0U);
    EXPECT_EQ(parse(";@ drum a 1 0 2\n;@ drum a 1 0 2\n").find("x.orc:2:1: error: found a second `a`"), 0U);
    EXPECT_EQ(parse(";@ drum a 1 0 2 the text\r\n"), "");
    EXPECT_EQ(audio::parse_instruments(";@ drum a 1 0 2  the text \r\n", "x").at(0).parameters.at(0).text,
              "the text");
}

TEST(OrchestraParser, FiveThousandMutationsEndInInstrumentsOrARuntimeError) {
    const std::string text = audio::read_text(kOrchestra).substr(0, 4500);
    std::mt19937 random(1);
    int refused = 0;
    for (int i = 0; i < 5000; ++i) {
        std::string mutant = text;
        for (int k = 0; k < 4; ++k) mutant[random() % mutant.size()] = static_cast<char>(random() % 256);
        if (i % 3 == 0) mutant.resize(random() % mutant.size());
        try {
            for (const auto& instrument : audio::parse_instruments(mutant, "x")) {
                for (const auto& parameter : instrument.parameters)
                    ASSERT_LE(parameter.minimum, parameter.maximum);
            }
        } catch (const std::runtime_error&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 100);
    EXPECT_LT(refused, 5000);
}

}  // namespace
