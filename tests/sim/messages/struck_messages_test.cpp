#include "messages/struck_messages.h"

#include <gtest/gtest.h>

#include <random>

#include "damaged_bytes.h"
#include "test_kit.h"

namespace {

std::vector<sim::Message> samples() {
    sim_test::Scenario scenario(6);
    const auto simulation = sim::make_local_simulation(scenario.bodies());
    sim::StepRequest request;
    for (int i = 0; i < 20; ++i) request = scenario.next(), scenario.learn(simulation->step(request));
    sim::Assign assign{3, {}};
    sim::Answer answer{5, 1234567890123, {}};
    for (std::uint32_t b = 2; b < 5; ++b) {
        sim::SteppedBody body(b, scenario.bodies()[b]);
        answer.outcomes.emplace_back();
        body.step(request, answer.outcomes.back());
        assign.bodies.push_back({b, scenario.bodies()[b], body.record()});
    }
    return {sim::Hello{{42}},
            sim::Heartbeat{{43}},
            sim::Welcome{},
            assign,
            sim::Step{9, 77, {0, 3, 4}, request},
            answer,
            sim::Stop{},
            sim::Failure{"a failure"}};
}

TEST(Messages, EveryTypeComesBackWithTheSameBits) {
    for (const sim::Message& message : samples()) {
        const std::vector<std::uint8_t> bytes = sim::encode(message);
        const sim::Message back = sim::decode(bytes);
        EXPECT_EQ(back.index(), message.index());
        EXPECT_EQ(sim::encode(back), bytes);
    }
}

TEST(Messages, ABodysStateRecordIs120Bytes) {
    sim::Answer one{1, 1, std::vector<sim::BodyOutcome>(1)}, two{1, 1, std::vector<sim::BodyOutcome>(2)};
    const std::size_t empty_lists = 12;  // three counts of pictures, clearances and contacts
    EXPECT_EQ(sim::encode(two).size() - sim::encode(one).size() - empty_lists, 120u);
}

TEST(Messages, ChecksumIsTheCommonCrc32) {
    const std::string text = "123456789";
    EXPECT_EQ(sim::crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}),
              0xCBF43926u);  // its published check value
}

void seal(std::vector<std::uint8_t>& bytes) {
    if (bytes.size() < 16) return;
    const auto length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(bytes.data() + 8, &length, 4);
    const std::uint32_t crc = sim::crc32({bytes.data(), bytes.size() - 4});
    std::memcpy(bytes.data() + bytes.size() - 4, &crc, 4);
}

TEST(Messages, TwentyThousandMutationsAreRefusedOrDecodeToSomethingThatEncodesToTheSameBytes) {
    std::mt19937 rng(15);
    const std::vector<sim::Message> messages = samples();
    int refused = 0, accepted = 0;
    for (int i = 0; i < 20000; ++i) {
        std::vector<std::uint8_t> bytes = sim::encode(messages[rng() % messages.size()]);
        bytes = damaged(std::move(bytes), rng);
        if (i % 4) seal(bytes);  // mostly past the checksum, so that the fields' own checks are met
        try {
            EXPECT_EQ(sim::encode(sim::decode(bytes)), bytes);
            ++accepted;
        } catch (const sim::DecodeError&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 5000);
    EXPECT_GT(accepted, 1000);
}

TEST(Messages, AnUnsealedChangeOfAnyByteIsRefused) {
    const std::vector<std::uint8_t> good = sim::encode(samples()[5]);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::vector<std::uint8_t> bad = good;
        bad[i] ^= 0x10;
        EXPECT_THROW((void)sim::decode(bad), sim::DecodeError) << i;
    }
}

}  // namespace
