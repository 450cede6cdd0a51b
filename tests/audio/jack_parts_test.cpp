#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "device_position.h"
#include "midi_events.h"

namespace {

using audio::DevicePosition;
using audio::MidiEvent;
using audio::MidiEvents;

/// A minute of cycles of 128 frames on a device whose clock is off by so many millionths; the largest
/// distance from the due sample after ten seconds.
double largest_error(DevicePosition& position, double ppm) {
    double largest = 0;
    double due = 1000.25;
    for (int cycle = 0; cycle < 22500; ++cycle) {
        const auto first = static_cast<double>(position.begin_cycle(due, 128, cycle > 0));
        if (cycle > 3750) largest = std::max(largest, std::abs(due - first));
        due += 128 * (1 + 1e-6 * ppm);
    }
    return largest;
}

TEST(DevicePosition, FollowsAClockThatIsOffByDroppingOrRepeatingAsManySamplesAsItDrifts) {
    for (const double ppm : {-300.0, -20.0, 20.0, 300.0}) {
        DevicePosition position;
        // 12 samples of tolerance, and what 64 cycles of smoothing lag behind at 300 ppm: 2.5; half a sample
        // of rounding.
        EXPECT_LE(largest_error(position, ppm), 16) << ppm;
        const double drift = 22500 * 128 * 1e-6 * std::abs(ppm);
        EXPECT_NEAR(static_cast<double>(position.corrections()), drift, 24) << ppm;
    }
}

TEST(DevicePosition, CorrectsNothingOnAClockThatIsRightButTrembles) {
    DevicePosition position;
    for (int cycle = 0; cycle < 10000; ++cycle) {
        (void)position.begin_cycle(128.0 * cycle + 40 * std::sin(1.7 * cycle), 128, cycle > 0);
    }
    EXPECT_EQ(position.corrections(), 0U);
}

TEST(DevicePosition, JumpsAfterAGapAndWhereItIsFarOff) {
    DevicePosition position;
    EXPECT_EQ(position.begin_cycle(-300.4, 128, false), -300);
    EXPECT_EQ(position.begin_cycle(-172.4, 128, true), -172);
    EXPECT_EQ(position.begin_cycle(83.6, 128, false), 84) << "two cycles were lost";
    EXPECT_EQ(position.begin_cycle(1000, 128, true), 1000);
    EXPECT_EQ(position.corrections(), 0U);
}

std::vector<MidiEvent> drain(MidiEvents& events) {
    std::vector<MidiEvent> all;
    for (; !events.empty(); events.pop_front()) all.push_back(events.front());
    return all;
}

TEST(MidiEvents, NoteOffFollowsItsNoteOnByATenthOfASecond) {
    MidiEvents events;
    ASSERT_TRUE(events.add({2'000'000'000, 40, 100}));
    ASSERT_TRUE(events.add({1'950'000'000, 41, 90}));
    const auto all = drain(events);
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(all[0].bytes, (std::array<std::uint8_t, 3>{0x99, 41, 90}));
    EXPECT_EQ(all[1].bytes, (std::array<std::uint8_t, 3>{0x99, 40, 100}));
    EXPECT_EQ(all[2].bytes, (std::array<std::uint8_t, 3>{0x89, 41, 0}));
    EXPECT_EQ(all[2].due_ns, 2'050'000'000);
    EXPECT_EQ(all[3].bytes, (std::array<std::uint8_t, 3>{0x89, 40, 0}));
    EXPECT_EQ(all[3].due_ns, 2'100'000'000);
}

TEST(MidiEvents, RollOnOneKeyEndsEachNoteBeforeTheNext) {
    MidiEvents events;
    for (std::int64_t i = 1; i <= 3; ++i) ASSERT_TRUE(events.add({50'000'000 * i, 38, 64}));
    const auto all = drain(events);
    ASSERT_EQ(all.size(), 6U);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(all[i].is_note_on(), i % 2 == 0) << i;
    EXPECT_EQ(all[1].due_ns, 100'000'000);
    EXPECT_EQ(all[5].due_ns, 250'000'000);
}

TEST(MidiEvents, AMessageIsAStatusAndTwoBytesOfData) {
    const auto is = [](std::initializer_list<std::uint8_t> bytes) {
        return audio::is_message(std::vector<std::uint8_t>(bytes));
    };
    EXPECT_TRUE(is({0x99, 38, 127}));
    EXPECT_FALSE(is({0xB0, 4, 255}));
    EXPECT_FALSE(is({0xB0, 200, 0}));
    EXPECT_FALSE(is({0x10, 4, 0}));
    EXPECT_FALSE(is({0xF8}));
}

TEST(MidiEvents, BeyondTheRoomAreRefused) {
    MidiEvents events;
    std::size_t added = 0;
    for (std::int64_t i = 0; i < 600; ++i) {
        added += events.add({i * 1'000'000'000, static_cast<std::uint8_t>(i % 100), 64}) ? 1 : 0;
    }
    EXPECT_EQ(added, MidiEvents::kCapacity / 2);
    EXPECT_EQ(drain(events).size(), MidiEvents::kCapacity);
}

}  // namespace
