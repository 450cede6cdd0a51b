#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <random>

#include "sealed_message.h"
#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "shared_scenes.h"

// What a member may send that no honest one would: damaged messages with a right length, past the sockets,
// into the application's and the workers' logic.

namespace sim {
namespace {

// Three workers, of which the first lies; the others have to finish with every body.
void run_with_a_liar(unsigned seed, int messages, int& sent) {
    DistributedSettings settings;
    settings.bound = 2;
    settings.steps = 60;
    world_test::Record record;
    Coordinator coordinator(world_test::busy_scene(), settings, record);
    std::map<std::uint32_t, std::unique_ptr<SharedWorldWorker>> workers;
    std::mt19937 random(seed);
    for (int i = 0; i < 3; ++i) (void)coordinator.join({});
    auto deliver = [&] {
        for (const Coordinator::Outgoing& out : coordinator.outgoing())
            for (const std::uint32_t to : out.to) {
                DecodedMessage message = decode_message(*out.bytes);
                if (const auto* scene = std::get_if<SceneMessage>(&message.message))
                    workers[to] = std::make_unique<SharedWorldWorker>(*scene);
                else if (workers.count(to) > 0)
                    workers[to]->receive(message.header, std::move(message.message));
            }
    };
    deliver();
    coordinator.start();
    int damaged = 0, idle = 0;
    for (int turn = 0; turn < 2000 && !coordinator.finished(); ++turn) {
        deliver();
        // As the application does after 30 s.
        if (++idle > 20) coordinator.lose_slowest("nothing was published"), idle = 0;
        for (auto& [number, worker] : workers) {
            if (worker->ready()) {
                worker->step();
                worker->end_step({.seconds = 1e-3 * (number + 1)});
                idle = 0;
            }
            for (std::vector<std::uint8_t>& bytes : worker->outgoing()) {
                const bool lies = number == 0 && turn > 5 && damaged < messages && random() % 4 == 0;
                for (unsigned n = lies ? 1 + random() % 3 : 0; n > 0; --n)
                    bytes[12 + random() % (bytes.size() - 12)] = static_cast<std::uint8_t>(random());
                if (lies) sim_test::seal(bytes), ++damaged;
                coordinator.receive(number, bytes), coordinator.advance();
            }
        }
    }
    sent += damaged;
    EXPECT_TRUE(coordinator.finished()) << "seed " << seed << ": " << record.notes;
    EXPECT_EQ(coordinator.result().steps, 60u) << "seed " << seed;
}

TEST(Damage, OfAMembersMessagesCrashesNobodyAndTheOthersFinish) {
    const int runs = std::getenv("MUSICWORLD_LONG") ? 2000 : 60;
    int sent = 0;
    for (int seed = 0; seed < runs; ++seed) run_with_a_liar(static_cast<unsigned>(seed), 20, sent);
    EXPECT_GT(sent, runs / 2);
}

/// Three workers. passes: whether one sends what it is to tell another of a step.
struct Three {
    using Workers = std::map<std::uint32_t, std::unique_ptr<SharedWorldWorker>>;
    template <typename Passes>
    void run(Passes passes) {
        DistributedSettings settings;
        settings.bound = 2, settings.steps = 60;
        settings.market.from_step = 5;
        Coordinator coordinator(world_test::busy_scene(), settings, record);
        for (int i = 0; i < 3; ++i) (void)coordinator.join({});
        coordinator.start();
        int idle = 0;
        for (int turn = 0; turn < 4000 && !coordinator.finished(); ++turn) {
            for (const Coordinator::Outgoing& out : coordinator.outgoing())
                for (const std::uint32_t to : out.to) {
                    DecodedMessage m = decode_message(*out.bytes);
                    if (const auto* scene = std::get_if<SceneMessage>(&m.message))
                        workers[to] = std::make_unique<SharedWorldWorker>(*scene);
                    else
                        workers.at(to)->receive(m.header, std::move(m.message));
                }
            // As the application does after 15 and 30 s.
            if (idle == 20) coordinator.note_waiting();
            if (++idle > 40) coordinator.lose_slowest("nothing was published"), idle = 0;
            for (auto& [number, worker] : workers) {
                if (worker->ready()) worker->step(), worker->end_step({.seconds = 1e-3}), idle = 0;
                for (const std::vector<std::uint8_t>& bytes : worker->outgoing()) {
                    const DecodedMessage m = decode_message(bytes);
                    const auto* told = std::get_if<NeighbourMessage>(&m.message);
                    if (!told || passes(number, told->to))
                        coordinator.receive(number, bytes), coordinator.advance();
                }
                more(coordinator, number, *worker);
            }
        }
        EXPECT_TRUE(coordinator.finished()) << record.notes;
        for (std::uint32_t worker = 0; worker < 3; ++worker)
            if (coordinator.is_member(worker)) members.push_back(worker);
    }
    std::function<void(Coordinator&, std::uint32_t, SharedWorldWorker&)> more =
        [](Coordinator&, std::uint32_t, SharedWorldWorker&) {};
    world_test::Record record;
    Workers workers;
    std::vector<std::uint32_t> members;  // in the end
};

// It publishes its steps, and so is not the slowest.
TEST(Silence, WhoSendsOneOtherNothingIsGivenUpAndNotThatOne) {
    for (const std::uint32_t silent : {0u, 1u, 2u}) {
        Three three;
        int turns = 0;
        three.run([&](std::uint32_t from, std::uint32_t to) {
            return from != silent || to != (silent + 1) % 3 || ++turns < 20;
        });
        EXPECT_EQ(std::ranges::count(three.members, silent), 0) << three.record.notes;
        EXPECT_EQ(three.members.size(), 2u) << three.record.notes;
    }
}

// Past the sockets: what a member's messages may cost the application and the others until it is lost.
TEST(Damage, OfAFloodingMemberIsBounded) {
    DistributedSettings settings;
    settings.bound = 2, settings.steps = 60;
    world_test::Record record;
    Coordinator coordinator(world_test::busy_scene(), settings, record);
    for (int i = 0; i < 3; ++i) (void)coordinator.join({});
    coordinator.start();
    (void)coordinator.outgoing();
    Offer offer{1, 1, std::vector<std::uint32_t>(100'000, 0), std::vector<float>(100'000, 0.1F)};
    std::size_t relayed = 0, sent = 0;
    for (; sent < 100'000 && coordinator.members().size() == 3; ++sent) {
        if (sent == 1) offer.bodies.resize(1), offer.cost_s.resize(1);
        coordinator.receive(0, encode({0, 0, 0}, offer));
        for (const Coordinator::Outgoing& out : coordinator.outgoing()) relayed += out.bytes->size();
    }
    EXPECT_EQ(coordinator.members(), (std::vector<std::uint32_t>{1, 2}));
    EXPECT_GT(sent, 300u);  // an honest one has room
    EXPECT_LT(sent, 600u);
    EXPECT_LT(relayed, 2u << 20);
    EXPECT_NE(record.notes.find("more messages than steps need"), std::string::npos) << record.notes;
}

// Offers for a structure are accepted whatever they cost, so only those count that the application asked for.
TEST(Offers, ForAStructureThatNobodyAskedForReachNobody) {
    DistributedSettings settings;
    settings.bound = 2, settings.steps = 60;
    world_test::Record record;
    Coordinator coordinator(world_test::busy_scene(), settings, record);
    for (int i = 0; i < 2; ++i) (void)coordinator.join({});
    coordinator.start();
    (void)coordinator.outgoing();
    std::uint32_t own = 0;
    while (coordinator.owner(static_cast<int>(own)) != 0) ++own;
    // Of a body, of none, and one as usual.
    const std::vector<Offer> offers = {
        {1, 1, {own}, {0.1F}, true}, {1, 2, {}, {}, true}, {1, 3, {own}, {0.1F}, false}};
    for (const Offer& offer : offers) {
        coordinator.receive(0, encode({0, 0, 0}, offer));
        const std::vector<Coordinator::Outgoing> sent = coordinator.outgoing();
        ASSERT_EQ(sent.size(), 1u);
        EXPECT_EQ(sent[0].to, std::vector<std::uint32_t>{offer.gathers ? 0u : 1u});
        const DecodedMessage message = decode_message(*sent[0].bytes);
        const auto* answer = std::get_if<OfferAnswer>(&message.message);
        ASSERT_EQ(answer != nullptr, offer.gathers);
        if (!answer) continue;
        EXPECT_EQ(message.header.worker, 1u);  // as if that one had declined: the seller goes on
        EXPECT_EQ(answer->number, offer.number);
        EXPECT_FALSE(answer->accepted);
    }
}

// Who bought waits for it, and is not given up for that.
TEST(Offers, WhoNeverHandsOverWhatItSoldIsGivenUp) {
    for (const std::uint32_t liar : {0u, 1u, 2u}) {
        Three three;
        bool offered = false;
        three.more = [&](Coordinator& coordinator, std::uint32_t number, SharedWorldWorker& worker) {
            if (number != liar || worker.steps_done() < 10 || offered) return;
            for (std::uint32_t body = 0; body < 14; ++body) {
                if (coordinator.owner(static_cast<int>(body)) != liar) continue;
                offered = true;
                for (const std::uint32_t to : {(liar + 1) % 3, (liar + 2) % 3}) {
                    coordinator.receive(
                        liar, encode({liar, 0, worker.steps_done()}, Offer{to, 99, {body}, {1e-9F}}));
                    coordinator.advance();
                }
                return;
            }
        };
        three.run([](std::uint32_t, std::uint32_t) { return true; });
        EXPECT_TRUE(offered);
        EXPECT_EQ(std::ranges::count(three.members, liar), 0) << three.record.notes;
        EXPECT_EQ(three.members.size(), 2u) << three.record.notes;
    }
}

// Offers of nothing, and answers to offers that nobody made, from a step to come or a past one.
TEST(Offers, OfNothingAndAnswersThatNobodyWaitsForHaveNobodyElseGivenUp) {
    for (const int kind : {0, 1, 2}) {
        Three three;
        int told = 0;
        three.more = [&](Coordinator& coordinator, std::uint32_t number, SharedWorldWorker& worker) {
            if (number != 2 || worker.steps_done() < 3 || told > 40 || !coordinator.is_member(2)) return;
            for (const std::uint32_t to : {0u, 1u}) {
                const OfferAnswer answer{to, static_cast<std::uint32_t>(told / 4), true};
                const WorkerMessage message = kind == 0 ? WorkerMessage(Offer{to, 9, {}, {}}) : answer;
                if (!coordinator.is_member(2)) return;
                coordinator.receive(2, encode({2, 0, kind == 2 ? 60 : worker.steps_done()}, message));
                coordinator.advance();
                ++told;
            }
        };
        three.run([](std::uint32_t, std::uint32_t) { return true; });
        EXPECT_GT(told, kind == 2 ? 0 : 40);
        EXPECT_EQ(std::ranges::count(three.members, 0u) + std::ranges::count(three.members, 1u), 2)
            << three.record.notes;
    }
}

}  // namespace
}  // namespace sim
