#include <gtest/gtest.h>

#include <random>

#include "damaged_bytes.h"
#include "messages/worker_messages.h"
#include "sealed_message.h"
#include "test_kit.h"

namespace {

std::vector<sim::WorkerMessage> struck_samples() {
    sim_test::Scenario scenario(6);
    const auto simulation = sim::make_local_simulation(scenario.bodies());
    sim::StepRequest request;
    for (int i = 0; i < 20; ++i) request = scenario.next(), scenario.learn(simulation->step(request));
    sim::StruckAssign assign{3, {}};
    sim::StruckAnswer answer{5, 1234567890123, {}};
    for (std::uint32_t b = 2; b < 5; ++b) {
        sim::SteppedBody body(b, scenario.bodies()[b]);
        answer.outcomes.emplace_back();
        body.step(request, answer.outcomes.back());
        assign.bodies.push_back({b, scenario.bodies()[b], body.record()});
    }
    return {assign, sim::StruckStep{9, 77, {0, 3, 4}, request}, answer};
}

TEST(StruckMessages, EveryTypeComesBackWithTheSameBits) {
    for (const sim::WorkerMessage& message : struck_samples()) {
        const std::vector<std::uint8_t> bytes = sim::encode({}, message);
        const sim::WorkerMessage back = sim::decode_message(bytes).message;
        EXPECT_EQ(back.index(), message.index());
        EXPECT_EQ(sim::encode({}, back), bytes);
    }
}

TEST(StruckMessages, ABodysStateRecordIs120Bytes) {
    sim::StruckAnswer one{1, 1, std::vector<sim::BodyOutcome>(1)},
        two{1, 1, std::vector<sim::BodyOutcome>(2)};
    const std::size_t empty_lists = 12;  // three counts of pictures, clearances and contacts
    EXPECT_EQ(sim::encode({}, two).size() - sim::encode({}, one).size() - empty_lists, 120u);
}

TEST(StruckMessages, TwentyThousandMutationsAreRefusedOrDecodeToSomethingThatEncodesToTheSameBytes) {
    std::mt19937 rng(15);
    const std::vector<sim::WorkerMessage> messages = struck_samples();
    int refused = 0, accepted = 0;
    for (int i = 0; i < 20000; ++i) {
        std::vector<std::uint8_t> bytes = sim::encode({}, messages[rng() % messages.size()]);
        bytes = damaged(std::move(bytes), rng);
        if (i % 4)
            sim_test::seal(bytes);  // mostly of the right length, so that the fields' own checks are met
        try {
            const sim::DecodedMessage back = sim::decode_message(bytes);
            EXPECT_EQ(sim::encode(back.header, back.message), bytes);
            ++accepted;
        } catch (const sim::DecodeError&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 5000);
    EXPECT_GT(accepted, 1000);
}

}  // namespace
