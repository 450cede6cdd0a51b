#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "falling_bodies.h"
#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "shared_scenes.h"

using namespace world_test;
using Failure = sim_bench::SimulatedProcessors::Failure;
using Kind = Failure::Kind;

namespace {

constexpr std::uint64_t kSteps = 30;
constexpr int kWorkers = 3;

// One worker starts with everything; trades from the third step on.
sim::DistributedSettings trading() {
    sim::DistributedSettings settings = for_steps(kSteps);
    settings.all_to_first = true;
    settings.market.from_step = 3;
    return settings;
}

sim_bench::SimulatedProcessors processors() {
    sim_bench::SimulatedProcessors how;
    how.count = kWorkers;
    how.modelled = true;
    return how;
}

int moving_bodies(const sim::WorldScene& scene) {
    int count = static_cast<int>(scene.later.size());
    for (const sim::WorldBody& body : scene.world.bodies) count += !body.fixed;
    return count;
}

// Failures of every kind and worker, at times that lie close together over all of the trading.
std::vector<std::vector<Failure>> failures(double elapsed, double silence) {
    const int times = std::getenv("MUSICWORLD_LONG") ? 60 : 12;
    std::vector<std::vector<Failure>> all;
    for (const Kind kind : {Kind::kill, Kind::stop, Kind::cut, Kind::drain, Kind::join})
        for (int worker = 0; worker < kWorkers; ++worker)
            for (int i = 0; i < times; ++i) {
                const double at = elapsed * (0.08 + 0.5 * (i + 0.3 * worker) / times);
                all.push_back({{at, worker, kind}});
                // Half of the stopped ones go on before anybody notices, half after.
                if (kind == Kind::stop)
                    all.back().push_back({at + silence * (i % 2 ? 0.5 : 1.5), worker, Kind::resume});
                // Some lose the next one, too, while their bodies are being shared out.
                if (i % 3 == 0 && kind != Kind::join)
                    all.back().push_back({at + silence * 1.01, (worker + 1) % kWorkers, kind});
                if (i % 4 == 0) all.back().push_back({at + silence * 1.2, 0, Kind::join});
            }
    return all;
}

}  // namespace

TEST(TradeFailures, AtEveryStageOfATradeLeaveEveryBodyWithOneOwnerAndTheRunFinished) {
    const sim::WorldScene scene = busy_scene();
    const sim::DistributedSettings settings = trading();
    Record whole;
    const auto unharmed = sim_bench::simulate_processors(scene, settings, processors(), whole);
    ASSERT_GE(unharmed.trades, 2u);
    EXPECT_EQ(unharmed.refused_messages, 0u) << whole.notes;
    const double silence = unharmed.elapsed_s / 8;
    std::uint64_t reowned = 0;
    for (const std::vector<Failure>& some : failures(unharmed.elapsed_s, silence)) {
        sim_bench::SimulatedProcessors how = processors();
        how.silence_s = silence;
        how.failures = some;
        Record record;
        const sim::DistributedResult result = sim_bench::simulate_processors(scene, settings, how, record);
        SCOPED_TRACE(std::to_string(static_cast<int>(some[0].kind)) + " of " +
                     std::to_string(some[0].worker) + " at " + std::to_string(some[0].time_s));
        EXPECT_EQ(result.steps, kSteps);
        EXPECT_TRUE(record.in_order);
        ASSERT_EQ(record.hashes.size(), kSteps + 1);
        int own = 0;
        for (const auto& [number, bodies] : record.own) {
            EXPECT_GE(bodies, 0) << "nobody gives what it has not";
            own += bodies;
        }
        EXPECT_EQ(own, moving_bodies(scene));
        reowned += static_cast<std::uint64_t>(result.bodies_reowned);
    }
    EXPECT_GT(reowned, 100u) << "failures met workers that owned bodies";
}

TEST(TradeFailures, DrawnAtRandomWithWanderingLoadsLeaveEveryBodyWithOneOwnerAndTheRunFinished) {
    const sim::WorldScene scene = busy_scene();
    sim::DistributedSettings settings = trading();
    settings.steps = 60;
    const unsigned runs = std::getenv("MUSICWORLD_LONG") ? 400 : 20;
    std::uint64_t trades = 0, reowned = 0;
    for (unsigned seed = 0; seed < runs; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed + 1);
        auto uniform = [&random] { return static_cast<double>(random()) / 4294967296.0; };
        sim_bench::SimulatedProcessors how = processors();
        how.count = 1 + static_cast<int>(random() % 5);
        how.latency_s = 1e-5 * std::pow(30, uniform());
        settings.all_to_first = seed % 2 == 0;
        settings.bound = static_cast<int>(random() % 6);
        // Slow for ten steps at a time, in an order that the seed decides.
        how.factor = [seed](int worker, std::uint64_t step) {
            const std::uint64_t mixed =
                (step / 10 * 31 + static_cast<unsigned>(worker) * 7 + seed) * 2654435761u;
            return (mixed >> 16) % 3 == 0 ? 3.0 : 1.0;
        };
        const double span = 0.015;
        how.silence_s = span / 12;
        for (int i = static_cast<int>(random() % 7); i > 0; --i) {
            const int worker = static_cast<int>(random() % 6);
            const auto kind = static_cast<Kind>(random() % 6);
            how.failures.push_back({span * uniform(), worker, kind});
        }
        // A stopped processor is either lost or goes on.
        Record record;
        sim::DistributedResult result;
        ASSERT_NO_THROW(result = sim_bench::simulate_processors(scene, settings, how, record))
            << record.notes;
        EXPECT_EQ(result.steps, settings.steps);
        EXPECT_TRUE(record.in_order);
        const int own = std::accumulate(record.own.begin(), record.own.end(), 0,
                                        [](int sum, const auto& worker) { return sum + worker.second; });
        EXPECT_EQ(own, moving_bodies(scene));
        trades += result.trades, reowned += static_cast<std::uint64_t>(result.bodies_reowned);
    }
    EXPECT_GT(trades, runs) << "bodies changed hands all the time";
    EXPECT_GT(reowned, runs);
}

// Whoever then comes to the last step by taking the bodies over publishes it as others do, before its exact states.
TEST(LastStep, OfBodiesWhoseOwnerIsLostOrLeavesAfterItIsDoneByWhoeverGetsThem) {
    for (const bool drains : {false, true})
        for (const int bodies : {1, 2}) {
            SCOPED_TRACE(std::to_string(bodies) + (drains ? " bodies, drains" : " bodies, lost"));
            sim::WorldScene scene;
            for (int i = 0; i < bodies; ++i) {
                scene.world.bodies.push_back(ball({3. * i, 0, 0}));
                scene.world.bodies.back().name += std::to_string(i);
            }
            sim::DistributedSettings settings = for_steps(20);
            settings.market.trade = false;
            Record record;
            sim::Coordinator coordinator(scene, settings, record);
            std::map<std::uint32_t, std::unique_ptr<sim::SharedWorldWorker>> workers;
            for (int i = 0; i < 3; ++i) (void)coordinator.join({});
            const auto deliver = [&] {
                for (const sim::Coordinator::Outgoing& out : coordinator.outgoing())
                    for (const std::uint32_t to : out.to) {
                        sim::DecodedMessage m = sim::decode_message(*out.bytes);
                        if (const auto* with = std::get_if<sim::SceneMessage>(&m.message))
                            workers[to] = std::make_unique<sim::SharedWorldWorker>(*with);
                        else
                            workers.at(to)->receive(m.header, std::move(m.message));
                    }
            };
            const auto send = [&](std::uint32_t number) {
                for (const std::vector<std::uint8_t>& bytes : workers.at(number)->outgoing())
                    coordinator.receive(number, bytes), coordinator.advance();
            };
            deliver();
            coordinator.start();
            const std::uint32_t first = coordinator.owner(0);
            bool gone = false;
            for (int turn = 0; turn < 200 && !coordinator.finished(); ++turn) {
                deliver();
                for (auto& [number, worker] : workers) {
                    const bool waits = number != first && !gone && worker->steps_done() >= 17;
                    if ((number == first && gone && !drains) || waits) continue;
                    if (worker->ready()) worker->step(), worker->end_step({.seconds = 1e-3});
                    send(number);
                }
                if (gone || workers.at(first)->steps_done() < 20) continue;
                gone = true;
                if (drains)
                    workers.at(first)->drain(), send(first);
                else
                    coordinator.lose(first, "killed");
            }
            EXPECT_TRUE(gone);
            EXPECT_TRUE(coordinator.finished()) << record.notes;
            EXPECT_EQ(coordinator.steps(), 20u);
            EXPECT_EQ(coordinator.result().lost, drains ? 0 : 1) << record.notes;
            EXPECT_EQ(coordinator.result().refused_messages, 0u) << record.notes;
        }
}

struct MomentumRecord : Record {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
    void at(std::uint64_t step, const sim::World& now) override {
        Record::at(step, now);
        momentum = now.momentum();
    }
};

double weight_of(const sim::World& world) {  // [N]
    double weight = 0;
    for (int i = 0; i < world.bodies(); ++i)
        if (world.definition(i).moves()) weight += 9.81 * world.rigid_mass(i).mass;
    return weight;
}

// Bodies of a worker that leaves change owners at a step that neither side has passed, like those that are sold.
TEST(Leaving, OutOfStepKeepsTheMomentumWhoeverLeavesAndWhenever) {
    sim::WorldScene scene;
    scene.world = sim_bench::falling_balls(60);
    const double weight = weight_of(sim::World(scene.world));
    sim::DistributedSettings settings = for_steps(120);
    for (const int bound : {0, 1, 4, 16})
        for (const int leave : {1, 2, 3}) {
            settings.bound = bound;
            sim_bench::SimulatedProcessors how = processors();
            how.count = 4;
            Record unharmed;
            const double whole = sim_bench::simulate_processors(scene, settings, how, unharmed).elapsed_s;
            for (int k = 0; k < leave; ++k)  // at once, or one after the other
                how.failures.push_back(
                    {whole * (0.2 + 0.17 * k * (bound % 4)), (bound + k) % how.count, Kind::drain});
            if (leave == 2) how.failures.push_back({0.5 * whole, 0, Kind::join});
            MomentumRecord record;
            const sim::DistributedResult result =
                sim_bench::simulate_processors(scene, settings, how, record);
            SCOPED_TRACE(std::to_string(leave) + " leave, bound " + std::to_string(bound) + record.notes);
            EXPECT_EQ(result.steps, settings.steps);
            EXPECT_EQ(result.left, leave);
            EXPECT_EQ(result.refused_messages, 0u);
            // To rounding: impulses travel as floats, and owners give up what rounding leaves.
            EXPECT_LT((record.momentum - result.outside_impulse).norm(), 1e-9 * weight * 120 / 60);
        }
}
// Its messages come at once, or only when the others have done some steps.
TEST(Leaving, BeforeTheStartKeepsTheMomentum) {
    for (const std::size_t late_by : {std::size_t{0}, std::size_t{3}, std::size_t{8}}) {
        sim::WorldScene scene;
        scene.world = world_test::on_floor();
        for (int i = 0; i < 27; ++i)
            scene.world.bodies.push_back(world_test::ball({3.0 * (i % 9), 4, 3.0 * (i / 9)}));
        sim::DistributedSettings settings = for_steps(120);
        settings.bound = 16;
        MomentumRecord record;
        sim::Coordinator coordinator(scene, settings, record);
        std::map<std::uint32_t, std::unique_ptr<sim::SharedWorldWorker>> workers;
        std::deque<std::pair<std::size_t, std::vector<std::uint8_t>>> late;  // of worker 0, by rounds
        std::size_t round = 0;
        const auto deliver = [&] {
            for (bool more = true; more;) {
                more = false;
                for (; !late.empty() && late.front().first <= round; late.pop_front())
                    coordinator.receive(0, late.front().second), coordinator.advance();
                for (const sim::Coordinator::Outgoing& out : coordinator.outgoing())
                    for (const std::uint32_t to : out.to) {
                        more = true;
                        sim::DecodedMessage message = sim::decode_message(*out.bytes);
                        if (const auto* of = std::get_if<sim::SceneMessage>(&message.message))
                            workers[to] = std::make_unique<sim::SharedWorldWorker>(*of);
                        else
                            workers.at(to)->receive(message.header, std::move(message.message));
                    }
                for (auto& [number, worker] : workers)
                    for (std::vector<std::uint8_t>& bytes : worker->outgoing()) {
                        more = true;
                        if (number == 0)
                            late.emplace_back(round + late_by, std::move(bytes));
                        else
                            coordinator.receive(number, bytes), coordinator.advance();
                    }
            }
        };
        for (int i = 0; i < 3; ++i) (void)coordinator.join({});
        deliver();
        workers.at(0)->drain();
        deliver();
        coordinator.start();
        for (; !coordinator.finished() && round < 2000; ++round) {
            deliver();
            for (auto& [number, worker] : workers)
                if (worker->ready()) worker->step(), worker->end_step({.seconds = 1e-3});
        }
        SCOPED_TRACE(std::to_string(late_by) + " rounds late: " + record.notes);
        EXPECT_EQ(coordinator.result().left, 1);
        EXPECT_EQ(coordinator.result().lost, 0);
        EXPECT_EQ(coordinator.steps(), 120u);
        const double weight = weight_of(sim::World(scene.world));
        EXPECT_LT((record.momentum - coordinator.result().outside_impulse).norm(), 1e-9 * weight * 120 / 60);
    }
}

// Balls that rebound in a box while workers join and leave, whose steps take now one time and now four. Who joins has not heard what was
// found before, nor who owned what then.
TEST(Leaving, AndJoiningOutOfStepKeepTheMomentumOfBallsThatRebound) {
    const sim::WorldDefinition box = [] {
        sim::WorldDefinition d = world_test::on_floor();
        for (const double side : {-1.0, 1.0}) {
            d.planes.push_back({Eigen::Vector3d(side, 0, 0), -4});
            d.planes.push_back({Eigen::Vector3d(0, 0, side), -4});
        }
        for (int i = 0; i < 40; ++i) {
            d.bodies.push_back(
                world_test::ball({-3 + 1.15 * (i % 6), 0.6 + 1.1 * (i / 36), -3 + 1.15 * (i / 6 % 6)}));
            d.bodies.back().restitution = 0.3 * (i % 3);
        }
        return d;
    }();
    const double weight = weight_of(sim::World(box));
    int left = 0, traded = 0;
    for (const bool leave : {false, true})
        for (unsigned seed = 0; seed < 30; ++seed) {
            std::mt19937 random(seed);
            const auto share = [&random] { return static_cast<double>(random()) / 4294967296.0; };
            sim::WorldScene scene;
            scene.world = box;
            const Eigen::Vector3d start = [&] {
                for (sim::WorldBody& body : scene.world.bodies) {
                    body.velocity.x() = 4 * share() - 2;
                    body.velocity.z() = 4 * share() - 2;
                }
                return sim::World(scene.world).momentum();
            }();
            sim::DistributedSettings settings = for_steps(200);
            settings.bound = std::array{0, 1, 2, 4, 8, 16, 32, 64}[random() % 8];
            settings.market.from_step = 3;
            settings.all_to_first = random() % 3 == 0;
            sim_bench::SimulatedProcessors how = processors(2 + static_cast<int>(random() % 5));
            how.latency_s = 1e-5 * std::pow(30, share());
            how.silence_s = 1e3;
            how.factor = [seed](int worker, std::uint64_t step) {
                const std::uint64_t number =
                    (step / 10 * 31 + static_cast<unsigned>(worker) * 7 + seed) * 2654435761U;
                return (number >> 16) % 3 == 0 ? 4.0 : 1.0;
            };
            for (int i = 1 + static_cast<int>(random() % 4); i > 0; --i) {
                const Kind kind = leave && random() % 2 == 0 ? Kind::drain : Kind::join;
                how.failures.push_back(
                    {0.06 * share(), static_cast<int>(random() % static_cast<unsigned>(how.count)), kind});
            }
            MomentumRecord record;
            const sim::DistributedResult result =
                sim_bench::simulate_processors(scene, settings, how, record);
            SCOPED_TRACE("seed " + std::to_string(seed) + (leave ? ", some leave: " : ": ") + record.notes);
            EXPECT_EQ(result.steps, settings.steps);
            EXPECT_EQ(result.lost, 0);
            // To rounding, as above.
            EXPECT_LT((record.momentum - start - result.outside_impulse).norm(), 1e-9 * weight * 200 / 60);
            left += result.left, traded += static_cast<int>(result.trades);
        }
    EXPECT_GT(left, 10);
    EXPECT_GT(traded, 500);
}
