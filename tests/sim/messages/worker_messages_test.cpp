#include "messages/worker_messages.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "damaged_bytes.h"
#include "messages/update_codec.h"
#include "sealed_message.h"
#include "world_bodies.h"

namespace {

using Rng = std::mt19937;

double uniform(Rng& rng, double low, double high) {  // the same with every library
    return low + (high - low) * (rng() / 4294967295.0);
}

Eigen::Vector3d vector(Rng& rng, double most) {
    return {uniform(rng, -most, most), uniform(rng, -most, most), uniform(rng, -most, most)};
}

Eigen::VectorXd coordinates(Rng& rng, int n, double most) {
    Eigen::VectorXd v(n);
    for (double& x : v) x = uniform(rng, -most, most);
    return v;
}

sim::WorldBodyState state(Rng& rng, int modes) {
    sim::WorldBodyState s;
    s.position = vector(rng, 50);
    s.orientation = Eigen::Quaterniond(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1),
                                       uniform(rng, -1, 1) + 1e-3)
                        .normalized();
    s.velocity = vector(rng, 20);
    s.angular_momentum = vector(rng, std::pow(10, uniform(rng, -12, 8)));
    s.q = coordinates(rng, modes, 0.3);
    s.q_dot = coordinates(rng, modes, 5);
    return s;
}

sim::StepImpulse impulse(Rng& rng, int modes) {
    sim::StepImpulse i;
    i.linear = vector(rng, 3), i.angular = vector(rng, 1);
    i.modal = coordinates(rng, modes, 2);
    return i;
}

sim::CrossImpulse crossed(Rng& rng, int own, int other, bool blow) {
    const auto floats = [&] { return sim::as_sent(vector(rng, 3)); };
    return {own, other, blow, floats(), floats(), floats()};
}

sim::WorldRecord record(Rng& rng, int body, int modes) {
    return {body, state(rng, modes), rng() % 2 == 0, rng() % 2 == 0, rng() % 2 == 0, 7, -1};
}

sim::Update update(Rng& rng, int modes, bool held) {
    sim::Update u;
    u.body = rng() % 400, u.state = state(rng, modes), u.held = held;
    u.asleep = rng() % 2, u.still = rng() % 2;
    if (held) u.impulse = impulse(rng, modes);
    return u;
}

sim::WorldScene scene() {
    sim::WorldScene s;
    s.world = world_test::on_floor();
    for (int i = 0; i < 3; ++i)
        s.world.bodies.push_back(world_test::ball({1.5 * i, 1, 0}, sim::Fidelity::modal));
    s.world.bodies[1].shape.bumps.push_back({{0, 1, 0}, 0.1, 0.3});
    s.world.constraints.push_back({"hangs", 0, {0, 0.5, 0}, -1, {0, 2, 0}});
    s.world.constraints.push_back({"joins", 0, {0, 0, 0}, 1, {0, 0, 1}, 1e5, 0.5, 40});
    sim::PointConstraint hinge{"turns", 2, {0, 0, 0.5}, 1};
    hinge.joint = sim::Joint::hinge, hinge.collide = false;
    hinge.frame_a = hinge.frame_b = Eigen::Quaterniond(0.6, 0, 0.8, 0);
    s.world.constraints.push_back(hinge);
    s.world.forces = {{1, {0, 0.1, 0}, {1, 2, 3}, true, 0.5, 0.75}};
    s.world.bodies.push_back(world_test::ball({9, 1, 0}));
    s.world.bodies[3].motion = {{0, {9, 1, 0}}, {1, {8, 1, 0}, Eigen::Quaterniond(0, 1, 0, 0)}};
    s.later = {world_test::box({0, 5, 0}, {1, 1, 2})};
    s.events = {{10, {0}, 0, 0, {}}, {20, {}, 0, 1, {{1, 2.5}}}};
    return s;
}

sim::StepReport report() {
    using enum sim::Mishap::Kind;
    return {0.001f,     0.002f,
            0.0003f,    0.0011f,
            3,          2,
            17,         25,
            {1, -2, 3}, {{quarantined, 2, 77, "velocity"}, {limited, 1, 77, {}}, {broken, 0, 76, {}}}};
}

std::vector<std::uint64_t> steps_of(const std::vector<sim::WorldRecord>& records) {
    return std::vector<std::uint64_t>(records.size(), 76);
}

std::vector<sim::WorkerMessage> world_samples() {
    Rng rng(6);
    std::vector<sim::WorldRecord> records = {record(rng, 0, 12), record(rng, 1, 0), record(rng, 2, 6)};
    sim::DistributedSettings settings;
    settings.bound = 4, settings.steps = 500;
    const std::vector<sim::FoundStep> found = {{75, {crossed(rng, 4, 7, false)}}, {76, {}}};
    sim::NeighbourMessage neighbour;
    neighbour.to = 2, neighbour.acknowledged = 97, neighbour.smoothed_s = 0.001f, neighbour.own = 3;
    neighbour.reach = {{Eigen::Vector3f(-1, 0, 2), Eigen::Vector3f(3, 1, 5)}, 0xff00ff, 2.5f};
    for (const bool held : {true, false}) neighbour.bodies.add(update(rng, 12, held));
    neighbour.crossed = {crossed(rng, 4, 7, false)}, neighbour.broken = {1};
    neighbour.places = {{7, {1, 2, 3}}};
    return {sim::JoinRequest{{42, 43}, "a host"},
            sim::Beat{},
            sim::Drained{},
            sim::WorkerFailure{"a failure"},
            sim::SceneMessage{3, scene(), settings},
            sim::Refusal{"another processor"},
            sim::EndOfRun{},
            sim::Members{{0, 1, 5}, true},
            sim::Ownership{1, 0, true, 77, records, records, steps_of(records)},
            sim::PastMessage{{1}, {{7, 2, 91}, {3, 0, 97}}},
            sim::StateMessage{report(), records},
            sim::UpdateMessage{
                report(), {update(rng, 12, true), update(rng, 12, false), update(rng, 0, true)}, {7}},
            sim::Offer{2, 9, {1, 2}, {0.001f, 0.002f}, true},
            sim::OfferAnswer{1, 9, true},
            sim::Handover{2, 9, records},
            sim::Gather{2, {5, 7}},
            sim::Leaves{},
            neighbour,
            sim::FoundMessage{2, 12, found}};
}

const sim::MessageHeader kHeader{3, 8, 1234567890123};

template <typename Message>
std::size_t size_of(const Message& message) {
    return sim::encode(kHeader, message).size();
}

sim::Update there_and_back(const sim::Update& u) {
    const auto bytes = sim::encode(kHeader, sim::UpdateMessage{{}, {u}, {}});
    return std::get<sim::UpdateMessage>(sim::decode_message(bytes).message).bodies.at(0);
}

/// They are shown on terminals and stand in JSON documents.
TEST(WorkerMessages, WordsOfPeersBecomePrintableWhereTheyArrive) {
    const std::string bad = "h\xff\x1b[31m\n";
    const auto arrived = [&](const sim::WorkerMessage& message) {
        return sim::decode_message(std::visit([](const auto& m) { return sim::encode(kHeader, m); }, message))
            .message;
    };
    EXPECT_EQ(std::get<sim::JoinRequest>(arrived(sim::JoinRequest{{}, bad})).host, "h??[31m?");
    EXPECT_EQ(std::get<sim::WorkerFailure>(arrived(sim::WorkerFailure{bad})).what, "h??[31m?");
    EXPECT_EQ(std::get<sim::Refusal>(arrived(sim::Refusal{bad})).why, "h??[31m?");
}

TEST(WorkerMessages, EveryTypeComesBackAndIsTheSameWhenWrittenAgain) {
    for (const sim::WorkerMessage& message : world_samples()) {
        const std::vector<std::uint8_t> bytes = sim::encode(kHeader, message);
        const sim::DecodedMessage back = sim::decode_message(bytes);
        EXPECT_EQ(back.message.index(), message.index());
        EXPECT_EQ(back.header.worker, kHeader.worker);
        EXPECT_EQ(back.header.epoch, kHeader.epoch);
        EXPECT_EQ(back.header.step, kHeader.step);
        EXPECT_EQ(sim::encode(back.header, back.message), bytes) << message.index();
    }
}

TEST(WorkerMessages, ASceneComesBackAsAWorldOfTheSameStatesToTheBit) {
    const auto back = std::get<sim::SceneMessage>(
        sim::decode_message(sim::encode(kHeader, sim::SceneMessage{0, scene(), {}})).message);
    sim::World here(scene().world), there(back.scene.world);
    world_test::run(here, 20);
    world_test::run(there, 20);
    EXPECT_EQ(here.state_hash(), there.state_hash());
    EXPECT_EQ(back.scene.events.at(1).slowing.at(0).factor, 2.5);
    EXPECT_EQ(back.scene.later.at(0).name, "box");
}

TEST(WorkerMessages, AnUpdateWithTwelveModesIs73BytesAnd98WhenItHoldsAnImpulse) {
    Rng rng(1);
    const auto bytes = [&](int modes, bool held) {
        sim::UpdateMessage one;
        one.bodies = {update(rng, modes, held)};
        return size_of(one) - size_of(sim::UpdateMessage{});
    };
    EXPECT_EQ(bytes(12, false), 73u);
    EXPECT_EQ(bytes(12, true), 98u);
    EXPECT_EQ(bytes(6, false), 55u);
    EXPECT_EQ(bytes(0, false), 36u);
}

TEST(WorkerMessages, AnExactRecordWithTwelveModesIs307Bytes) {
    Rng rng(1);
    sim::StateMessage one;
    one.bodies = {record(rng, 3, 12)};
    EXPECT_EQ(size_of(one) - size_of(sim::StateMessage{}), 307u);
}

// The bounds that update_codec.h states.
TEST(WorkerMessages, TenThousandUpdatesComeBackWithinTheStatedErrors) {
    Rng rng(2);
    const auto half_bound = [](double x) { return std::abs(x) / 2048 + 3e-8; };
    for (int i = 0; i < 10000; ++i) {
        const sim::Update u = update(rng, 12, true), back = there_and_back(u);
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(back.state.position[k], u.state.position[k],
                        std::ldexp(std::abs(u.state.position[k]), -24));
            EXPECT_NEAR(back.state.velocity[k], u.state.velocity[k], half_bound(u.state.velocity[k]));
            EXPECT_NEAR(back.impulse.linear[k], u.impulse.linear[k], half_bound(u.impulse.linear[k]));
            EXPECT_NEAR(back.impulse.angular[k], u.impulse.angular[k], half_bound(u.impulse.angular[k]));
        }
        EXPECT_LT(back.state.orientation.angularDistance(u.state.orientation), 1.9e-5);
        EXPECT_NEAR(back.state.orientation.norm(), 1, 1e-15);
        EXPECT_LE((back.state.angular_momentum - u.state.angular_momentum).cwiseAbs().maxCoeff(),
                  u.state.angular_momentum.cwiseAbs().maxCoeff() / 4095 + std::ldexp(1.0, -45));
        for (int k = 0; k < 12; ++k) {
            EXPECT_NEAR(back.state.q[k], u.state.q[k], half_bound(u.state.q[k]));
            EXPECT_NEAR(back.state.q_dot[k], u.state.q_dot[k], u.state.q_dot.cwiseAbs().maxCoeff() / 127);
            EXPECT_NEAR(back.impulse.modal[k], u.impulse.modal[k],
                        u.impulse.modal.cwiseAbs().maxCoeff() / 127);
        }
    }
}

TEST(WorkerMessages, OrientationsWithEqualComponentsAndQuarterTurnsComeBackWithinTheStatedError) {
    for (int w = -1; w <= 1; ++w)
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    if (w == 0 && x == 0 && y == 0 && z == 0) continue;
                    Rng rng(3);
                    sim::Update u = update(rng, 0, false);
                    u.state.orientation = Eigen::Quaterniond(w, x, y, z).normalized();
                    EXPECT_LT(there_and_back(u).state.orientation.angularDistance(u.state.orientation),
                              1.9e-5);
                }
}

TEST(WorkerMessages, NumbersBeyondWhatAnUpdateHoldsBecomeTheLargestThatItHolds) {
    Rng rng(4);
    sim::Update u = update(rng, 1, false);
    u.state.velocity = {9e5, -9e5, 0};
    u.state.q[0] = 1e9;
    u.state.angular_momentum = {1e30, -1e30, 1};
    const sim::WorldBodyState back = there_and_back(u).state;
    EXPECT_EQ(back.velocity, Eigen::Vector3d(65504, -65504, 0));
    EXPECT_EQ(back.q[0], 65504);
    EXPECT_NEAR(back.angular_momentum.x(), 2.147e9, 1e6);
}

TEST(WorkerMessages, AStateThatIsNotFiniteTravelsAsAMarkAndComesBackWithoutAPlace) {
    Rng rng(5);
    sim::WorldRecord r = record(rng, 3, 12);
    r.state.q_dot[5] = std::nan("");
    sim::Update u = update(rng, 12, true);
    u.state.velocity.x() = std::numeric_limits<double>::infinity();
    sim::StateMessage message;
    message.bodies = {r};
    const auto back = std::get<sim::StateMessage>(sim::decode_message(sim::encode(kHeader, message)).message);
    for (const sim::WorldBodyState& s : {back.bodies.at(0).state, there_and_back(u).state}) {
        EXPECT_TRUE(std::isnan(s.position.x()));
        EXPECT_EQ(s.q, Eigen::VectorXd::Zero(12));
        EXPECT_EQ(s.velocity, Eigen::Vector3d::Zero());
    }
}

// What decodes is something that this end could have written: written again it has the same length and comes
// back once more. (Not the same bytes: of two components of an orientation that are equal either may be the
// largest, and a broken state's numbers are not kept.)
TEST(WorkerMessages, TenThousandMutationsAreRefusedOrDecodeToAMessageThatCanBeWrittenAgain) {
    const int count = std::getenv("MUSICWORLD_LONG") ? 1000000 : 10000;
    Rng rng(15);
    std::vector<std::vector<std::uint8_t>> good;
    for (const sim::WorkerMessage& message : world_samples()) good.push_back(sim::encode(kHeader, message));
    int refused = 0, accepted = 0;
    for (int i = 0; i < count; ++i) {
        std::vector<std::uint8_t> bytes = good[rng() % good.size()];
        bytes = damaged(std::move(bytes), rng);
        if (i % 4) sim_test::seal(bytes);  // mostly past the length, so that the fields' own checks are met
        try {
            const sim::DecodedMessage back = sim::decode_message(bytes);
            const std::vector<std::uint8_t> again = sim::encode(back.header, back.message);
            EXPECT_EQ(again.size(), bytes.size());
            EXPECT_NO_THROW((void)sim::decode_message(again));
            ++accepted;
        } catch (const sim::DecodeError&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, count / 4);
    EXPECT_GT(accepted, count / 20);
}

template <typename Message>
void expect_refused(Message message) {
    EXPECT_THROW((void)sim::decode_message(sim::encode(kHeader, message)), sim::DecodeError);
}

TEST(WorkerMessages, ScenesThatWorldWouldRefuseAreRefused) {
    const sim::SceneMessage good{0, scene(), {}};
    EXPECT_NO_THROW((void)sim::decode_message(sim::encode(kHeader, good)));
    const auto wrong = [&](const auto& change) {
        sim::SceneMessage bad = good;
        change(bad);
        expect_refused(bad);
    };
    wrong([](auto& m) { m.scene.world.bodies[0].material.poisson = 0.7; });
    wrong([](auto& m) { m.scene.world.bodies[0].fidelity.modes = 121; });
    wrong([](auto& m) { m.scene.world.constraints[0].body_a = 4; });
    wrong([](auto& m) { m.scene.world.constraints[2].frame_a.w() = 2; });
    wrong([](auto& m) { m.scene.world.forces[0].body = 5; });
    wrong([](auto& m) { m.scene.world.forces[0].until_s = 0.4; });
    wrong([](auto& m) { m.scene.world.bodies[3].motion[1].time_s = 0; });
    wrong([](auto& m) { m.scene.world.settings.dt = std::nan(""); });
    wrong([](auto& m) { m.scene.later[0].triangles = 1 << 30; });
    wrong([](auto& m) { m.scene.events[0].removed = {3}; });
    wrong([](auto& m) { m.scene.events[1].end = 2; });
    wrong([](auto& m) { m.scene.events[1].step = 3; });
    wrong([](auto& m) { m.scene.events[1].slowing[0].factor = 0; });
    wrong([](auto& m) { m.settings.bound = -1; });
    wrong([](auto& m) { m.settings.market.smoothing_steps = 0; });
}

}  // namespace
