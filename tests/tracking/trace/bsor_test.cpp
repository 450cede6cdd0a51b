#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "mutation.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

/// Writes replays as the format's page describes them: little endian, texts with their length before them.
class Writer {
public:
    Writer& word(std::uint32_t value) {
        for (int i = 0; i < 4; ++i) bytes_ += static_cast<char>(value >> (8 * i));
        return *this;
    }
    Writer& number(double value) { return word(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
    Writer& byte(int value) {
        bytes_ += static_cast<char>(value);
        return *this;
    }
    Writer& text(const std::string& text) {
        word(static_cast<std::uint32_t>(text.size()));
        bytes_ += text;
        return *this;
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

struct Frame {
    double t;
    double x = 0.25;  ///< of the right hand
    double w = 0.6;   ///< with x = 0.8 of its quaternion
};

std::string replay(const std::vector<Frame>& frames, std::uint32_t counted, const std::string& player = "a",
                   std::uint32_t player_length = 1) {
    Writer out;
    out.word(0x442d3d69).byte(1).byte(0);
    for (const char* text : {"0.7", "1.29", "1681105392", "7"}) out.text(text);
    out.word(player_length);
    for (const char c : player) out.byte(c);
    for (const char* text : {"steam", "OpenVR", "headset", "knuckles", "hash", "song", "mapper", "Normal"})
        out.text(text);
    out.word(352363).text("Standard").text("Big Mirror").text("");
    out.number(12).byte(0).number(2).number(0).number(0).number(0).byte(1).word(counted);
    for (const Frame& frame : frames) {
        out.number(frame.t).word(90);
        for (const double v : {0.0, 1.7, 0.0, 0.0, 0.0, 0.0, 1.0}) out.number(v);          // head
        for (const double v : {-0.25, 1.0, 0.5, 0.0, 0.6, 0.0, 0.8}) out.number(v);        // left
        for (const double v : {frame.x, 1.0, 0.5, 0.8, 0.0, 0.0, frame.w}) out.number(v);  // right
    }
    return out.byte(2).word(0).bytes();
}

std::string replay(const std::vector<Frame>& frames) {
    return replay(frames, static_cast<std::uint32_t>(frames.size()));
}

void expect_replay_refused(const std::string& bytes, const std::string& start, const std::string& found) {
    try {
        static_cast<void>(parse_trace(bytes, "r.bsor"));
        FAIL() << "read: " << found;
    } catch (const TraceError& error) {
        const std::string what = error.what();
        EXPECT_TRUE(what.starts_with(start)) << what;
        EXPECT_NE(what.find(found), std::string::npos) << what;
    }
}

TEST(Bsor, BothSabersAreMirroredToRightHandedAxes) {
    const Trace trace = parse_trace(replay({{1}, {1.25}, {1.5}}), "r.bsor");
    ASSERT_EQ(trace.sticks.size(), 2u);
    EXPECT_EQ(trace.sticks[0].name, "left");
    EXPECT_EQ(trace.sticks[1].name, "right");
    EXPECT_EQ(trace.tip.value(), Eigen::Vector3d(0, 0, -0.35));
    EXPECT_EQ(trace.shaft.value(), Eigen::Vector3d(0, 0, -1));
    const PoseSample& right = trace.sticks[1].samples[2];
    EXPECT_EQ(right.t_s, 1.5);
    EXPECT_EQ(right.position, Eigen::Vector3d(0.25, 1, -0.5));
    // The file's floats are good to 6e-8.
    EXPECT_LT((right.orientation.coeffs() - Eigen::Vector4d(-0.8, 0, 0, 0.6)).norm(), 1e-7);
    EXPECT_LT((trace.sticks[0].samples[0].orientation.coeffs() - Eigen::Vector4d(0, -0.6, 0, 0.8)).norm(),
              1e-7);
    EXPECT_TRUE(trace.remarks.empty());
    EXPECT_EQ(trace.source.find('7'), std::string::npos) << "the player's number is not kept";
}

TEST(Bsor, FramesThatDoNotAdvanceAndTheStartUpAreLeftOutAndCounted) {
    // At 0 the right saber lies 4 m off and has no orientation yet; 4 m in 20 ms is 200 m/s.
    const Trace trace = parse_trace(
        replay(
            {{0, 4.25, 0}, {0, 0.25}, {0.02}, {0.04}, {0.04, 0.3}, {0.03, 0.3}, {0.06}, {0.9}, {0.91, 4.25}}),
        "r.bsor");
    const std::vector<PoseSample>& right = trace.sticks[1].samples;
    ASSERT_EQ(right.size(), 5u);
    EXPECT_NEAR(right[0].t_s, 0.02, 1e-8);
    EXPECT_NEAR(right[2].t_s, 0.06, 1e-8);
    EXPECT_EQ(right[4].position.x(), 4.25) << "after the first half second a jump is the sensor's affair";
    ASSERT_EQ(trace.remarks.size(), 2u);
    EXPECT_NE(trace.remarks[0].find("3 frames not later"), std::string::npos) << trace.remarks[0];
    EXPECT_NE(trace.remarks[1].find("1 frames of the start-up"), std::string::npos) << trace.remarks[1];
}

TEST(Bsor, APlayersNameCountedInCharactersIsReadAsItsBytes) {
    const Trace trace = parse_trace(replay({{1}, {2}}, 2, "\xD0\x96\xD0\xB0\xD0\xB1\xD0\xB0", 4), "r.bsor");
    EXPECT_EQ(trace.sticks[0].samples.size(), 2u);
}

TEST(Bsor, QuaternionsOfEitherSignReadToContinuousOnes) {
    std::string bytes = replay({{1}, {2}, {3}});
    const std::size_t middle = bytes.size() - 5 - 92 - 92 + 8 + 28 + 28 + 12;  // the right hand's in frame 2
    for (std::size_t i = 0; i < 4; ++i)
        bytes[middle + 4 * i + 3] = static_cast<char>(bytes[middle + 4 * i + 3] ^ 0x80);
    const Trace trace = parse_trace(bytes, "r.bsor");
    for (const PoseSample& sample : trace.sticks[1].samples) EXPECT_NEAR(sample.orientation.w(), 0.6, 1e-7);
}

TEST(Bsor, FaultsAreRefusedWithTheirByte) {
    const std::string good = replay({{1}, {2}});
    const std::size_t frames = good.size() - 5 - 2 * 92;
    std::string bytes = good;
    bytes[4] = 2;
    expect_replay_refused(bytes, "r.bsor:byte 4: error: found format version 2", "expected version 1");
    expect_replay_refused(good.substr(0, frames + 100), "r.bsor:byte " + std::to_string(frames - 4) + ":",
                          "2 frames");
    expect_replay_refused(good.substr(0, 9), "r.bsor:byte 9:", "end of the file");
    expect_replay_refused(replay({{1}, {2}}, 0xFFFFFFFFu), "r.bsor:byte " + std::to_string(frames - 4) + ":",
                          "4294967295 frames");
    bytes = good;
    bytes[6] = bytes[7] = bytes[8] = bytes[9] = '\xFF';
    expect_replay_refused(bytes, "r.bsor:byte 6:", "4294967295 bytes");
    expect_replay_refused(replay({{1}}), "r.bsor:byte ", "at least two");
    expect_replay_refused(replay({{1, std::nan("")}, {2}}),
                          "r.bsor:byte " + std::to_string(frames + 64) + ":", "1000 m");
    expect_replay_refused(replay({{1, std::nan("")}, {1.01}}), "r.bsor:byte ", "1 frames after the start-up");
    expect_replay_refused(replay({{1, 2000}, {2, 2000}}), "r.bsor:byte " + std::to_string(frames + 64) + ":",
                          "1000 m");
    expect_replay_refused(replay({{1, 0, 0.1}, {2, 0, 0.1}}),
                          "r.bsor:byte " + std::to_string(frames + 76) + ":", "a quaternion");
    expect_replay_refused(replay({{1}, {std::nan("")}}), "r.bsor:byte " + std::to_string(frames + 92) + ":",
                          "time");
}

TEST(Bsor, FiveHundredMutationsEachAreReadAsValidTracesOrRefusedWithTheirByte) {
    std::vector<Frame> frames;
    for (int k = 0; k < 12; ++k) frames.push_back({0.011 * k, 0.25 + 0.01 * k});
    const Outcomes outcomes = mutate_and_read(
        replay(frames), 500, 7, [](const std::string& bytes) { return parse_trace(bytes, "fuzz.bsor"); });
    EXPECT_GT(outcomes.read, 20);
    EXPECT_GT(outcomes.refused, 20);
}

}  // namespace
}  // namespace tracking
