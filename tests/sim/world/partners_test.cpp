// A step by several partners has the bits of one world's, however bodies are shared out.
#include "world/partners.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <random>
#include <thread>

#include "large_scenes.h"

using namespace world_test;

namespace {

/// What partners in threads tell each other, and one who only listens (-1).
class Mail {
public:
    explicit Mail(int count) : boxes_(std::size_t((count + 1) * (count + 1))), count_(count) {}
    void put(int from, int to, sim::Partners::Bytes bytes) {
        const std::lock_guard lock(mutex_);
        box(from, to).push_back(std::move(bytes));
        come_.notify_all();
    }
    sim::Partners::Bytes take(int from, int to) {
        std::unique_lock lock(mutex_);
        auto& mine = box(from, to);
        // Who was told something else than the others may wait for what nobody tells.
        come_.wait_for(lock, std::chrono::seconds(2), [&] { return !mine.empty() || given_up_; });
        if (given_up_ || mine.empty()) throw sim::NotTogether("given up");
        sim::Partners::Bytes bytes = std::move(mine.front());
        mine.pop_front();
        return bytes;
    }
    void give_up() {
        const std::lock_guard lock(mutex_);
        given_up_ = true;
        come_.notify_all();
    }
    [[nodiscard]] int count() const { return count_; }

    std::atomic<int> told = 0;  ///< to one alone: by those who sweep an island together

private:
    std::deque<sim::Partners::Bytes>& box(int from, int to) {
        return boxes_[std::size_t((from + 1) * (count_ + 1) + to + 1)];
    }
    std::mutex mutex_;
    std::condition_variable come_;
    std::vector<std::deque<sim::Partners::Bytes>> boxes_;
    int count_;
    bool given_up_ = false;
};

/// What is done to the bytes that one hears.
using Damage = std::function<void(sim::Partners::Bytes&)>;

class ThreadPartner final : public sim::Partners {
public:
    ThreadPartner(Mail& mail, int self, std::vector<int> of, int silent_after, Damage damage = {})
        : Partners(self, mail.count(), std::move(of)),
          mail_(mail),
          left_(silent_after),
          damage_(std::move(damage)) {}
    void tell(int partner, Bytes&& bytes) override {
        if (left_ >= 0 && left_-- == 0) {
            mail_.give_up();
            throw sim::NotTogether("it is killed");
        }
        mail_.put(self(), partner, std::move(bytes));
        ++mail_.told;
    }
    void tell_all(Bytes&& bytes) override {
        if (self() < 0) return;
        for (int p = 0; p < count(); ++p)
            if (p != self()) tell(p, Bytes(bytes)), --mail_.told;
        mail_.put(self(), -1, std::move(bytes));
    }
    Bytes hear(int partner) override {
        Bytes bytes = mail_.take(partner, self());
        if (damage_) damage_(bytes);
        return bytes;
    }

private:
    Mail& mail_;
    int left_;  // messages until it falls silent; negative: never
    Damage damage_;
};

void step_alone(sim::World& world) {
    Mail nobody(1);
    ThreadPartner one(nobody, 0, {}, -1);
    world.step_together(one);
}

/// A step of worlds of the same bodies; returns how often one told something to one other alone.
int step_all(std::vector<sim::World>& worlds, const std::vector<int>& whose) {
    Mail mail(int(worlds.size()));
    std::vector<std::thread> threads;
    for (int p = 0; p < mail.count(); ++p)
        threads.emplace_back([&, p] {
            ThreadPartner partner(mail, p, whose, -1);
            worlds[std::size_t(p)].step_together(partner);
        });
    for (std::thread& thread : threads) thread.join();
    return mail.told;
}

struct Steps {
    std::vector<std::uint64_t> hashes;
    std::vector<sim::WorldCounts> counts;
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();
    int alone = 0;         ///< steps that were not finished together
    int told = 0;          ///< by one to one other: of islands that are swept together
    int with_impacts = 0;  ///< steps with impacts in which an island was swept together
    std::vector<sim::ContactRecord> contacts = {};  ///< at the end
};

void expect_same(const std::vector<sim::ContactRecord>& found,
                 const std::vector<sim::ContactRecord>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        const sim::ContactRecord &one = found[i], &other = expected[i];
        ASSERT_EQ(std::tuple(one.a, one.b, one.count, one.emerging),
                  std::tuple(other.a, other.b, other.count, other.emerging));
        for (std::size_t k = 0; k < std::size_t(one.count); ++k) {
            EXPECT_EQ(one.points[k].feature, other.points[k].feature);
            EXPECT_EQ(one.points[k].arm_a, other.points[k].arm_a);
            EXPECT_EQ(one.points[k].normal_impulse, other.points[k].normal_impulse);
            EXPECT_EQ(one.points[k].friction_impulse, other.points[k].friction_impulse);
        }
    }
}

Steps alone(const sim::WorldDefinition& definition, int steps, const sim::WorldSnapshot* from = nullptr) {
    Steps run;
    sim::World world(definition);
    if (from) world.rewind(*from);
    for (int i = 0; i < steps; ++i) {
        world.step();
        run.hashes.push_back(world.state_hash());
        run.counts.push_back(world.counts());
    }
    run.outside = world.outside_impulse();
    run.contacts = world.snapshot().contacts;
    return run;
}

/// By partners, and one who only listens. of(step, body): whose it is then. silent(step, partner): messages after which that one
/// gives up in the step, or -1.
template <typename Of, typename Silent>
Steps together(const sim::WorldDefinition& definition, int steps, int partners, Of of, Silent silent,
               const sim::WorldSnapshot* from = nullptr) {
    std::vector<sim::World> worlds;  // last that of the listener
    for (int p = 0; p <= partners; ++p) {
        worlds.emplace_back(definition);
        if (from) worlds.back().rewind(*from);
    }
    Steps run;
    for (int i = 0; i < steps; ++i) {
        Mail mail(partners);
        std::vector<int> whose;
        for (int body = 0; body < worlds[0].bodies(); ++body) whose.push_back(of(i, body));
        std::vector<std::thread> threads;
        std::atomic<int> gave_up = 0;
        for (int p = 0; p <= partners; ++p)
            threads.emplace_back([&, p] {
                sim::World& world = worlds[std::size_t(p)];
                for (int body = 0; body < world.bodies(); ++body)
                    world.set_own(body, whose[std::size_t(body)] == p);
                const std::uint64_t before = world.state_hash();
                const bool listens = p == partners;
                ThreadPartner partner(mail, listens ? -1 : p, whose, listens ? -1 : silent(i, p));
                try {
                    world.step_together(partner);
                } catch (const sim::NotTogether&) {
                    ++gave_up;
                    mail.give_up();
                    EXPECT_EQ(world.state_hash(), before) << "it is as it was";
                    step_alone(world);
                }
            });
        for (std::thread& thread : threads) thread.join();
        run.alone += gave_up > 0, run.told += mail.told;
        const std::uint64_t before = run.counts.empty() ? 0 : run.counts.back().impacts;
        run.with_impacts += mail.told > 0 && worlds[0].counts().impacts > before;
        run.hashes.push_back(worlds[0].state_hash());
        run.counts.push_back(worlds[0].counts());
        for (const sim::World& world : worlds)
            EXPECT_EQ(world.state_hash(), run.hashes.back()) << "step " << i;
        if (testing::Test::HasFailure()) break;
    }
    run.outside = worlds[0].outside_impulse();
    for (const sim::World& world : worlds)
        EXPECT_EQ(world.outside_impulse(), run.outside) << "each knows all";
    run.contacts = worlds[0].snapshot().contacts;
    for (const sim::World& world : worlds) expect_same(world.snapshot().contacts, run.contacts);
    return run;
}

const auto kNeverSilent = [](int, int) { return -1; };

void expect_same_bits(const sim::WorldDefinition& definition, int steps, bool all_together) {
    const Steps one = alone(definition, steps);
    for (const int partners : {2, 3, 5}) {
        SCOPED_TRACE(partners);
        const Steps several = together(
            definition, steps, partners,
            [&](int step, int body) { return (body * 7 + step / 10) % partners; }, kNeverSilent);
        for (std::size_t i = 0; i < one.hashes.size() && i < several.hashes.size(); ++i)
            ASSERT_EQ(several.hashes[i], one.hashes[i]) << "step " << i;
        expect_same(several.contacts, one.contacts);
        EXPECT_EQ(several.counts.back().pairs, one.counts.back().pairs);
        EXPECT_EQ(several.counts.back().asleep, one.counts.back().asleep);
        EXPECT_EQ(several.counts.back().solved_again, one.counts.back().solved_again);
        EXPECT_EQ(several.counts.back().deformations_limited, one.counts.back().deformations_limited);
        // Sums in another order.
        EXPECT_LT((several.outside - one.outside).norm(), 1e-9 * (1 + one.outside.norm()));
        if (all_together) {
            EXPECT_EQ(several.alone, 0);
        }
    }
}

TEST(Partners, APileOfOneIslandHasTheBitsOfOneWorld) {
    expect_same_bits(pile(), 60, false);
}

TEST(Partners, APileThatRestsIsSolvedTogetherAtEveryStep) {
    sim::WorldDefinition definition = pile();
    for (sim::WorldBody& body : definition.bodies) {
        body.restitution = 0;
        body.velocity.setZero();
        body.motion.clear();
    }
    expect_same_bits(definition, 120, true);
}

TEST(Partners, RandomScenesHaveTheBitsOfOneWorld) {
#ifdef MUSICWORLD_SANITIZED
    constexpr unsigned kSeeds = 4;  // a minute for all of them
#else
    constexpr unsigned kSeeds = 20;
#endif
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        SCOPED_TRACE(seed);
        expect_same_bits(random_scene(seed), 12, false);
        if (HasFatalFailure()) return;
    }
}

// Turned frames, impacts beside and across borders, springs across them.
TEST(Partners, HeapsThatAreThrownTogetherHaveTheBitsOfOneWorld) {
#ifdef MUSICWORLD_SANITIZED
    constexpr unsigned kSeeds = 1;  // a minute
#else
    constexpr unsigned kSeeds = 5;
#endif
    int with_impacts = 0;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        SCOPED_TRACE(seed);
        const sim::WorldDefinition definition = heap(seed);
        const Steps one = alone(definition, 40);
        for (const int partners : {2, 4}) {
            const Steps several = together(
                definition, 40, partners, [&](int, int body) { return body * partners / 200; }, kNeverSilent);
            ASSERT_EQ(several.hashes, one.hashes) << partners << " partners";
            EXPECT_LT((several.outside - one.outside).norm(), 1e-9 * (1 + one.outside.norm()));
            EXPECT_EQ(several.alone, 0);
            with_impacts += several.with_impacts;
        }
    }
    EXPECT_GT(with_impacts, 4);
}

// More partners than slabs: some sweep nothing, but see the same energies of soft springs.
TEST(Partners, AHeapThatLiesWithTiesHasTheBitsOfOneWorldForAnyNumber) {
    sim::WorldDefinition definition = heap(1);
    for (sim::WorldBody& body : definition.bodies) body.restitution = 0;
    sim::World lying(definition);
    for (int i = 0; i < 150; ++i) lying.step();
    const sim::WorldSnapshot from = lying.snapshot();
    const Steps one = alone(definition, 40, &from);
    for (const int partners : {2, 9}) {
        const Steps several = together(
            definition, 40, partners, [&](int step, int body) { return (body + step / 7) % partners; },
            kNeverSilent, &from);
        ASSERT_EQ(several.hashes, one.hashes) << partners << " partners";
        expect_same(several.contacts, one.contacts);
        EXPECT_EQ(several.alone, 0);
        EXPECT_GT(several.told, 0) << "it is swept together";
        EXPECT_LT(several.with_impacts, 40) << "parts without contacts";
    }
}

// A tie that breaks in an island that is swept together: its bodies meet from then on.
TEST(Partners, TiesThatBreakInAHeapBreakForAll) {
    sim::WorldDefinition definition = heap(1);
    for (sim::PointConstraint& tie : definition.constraints) tie.collide = false;
    sim::World lying(definition);
    for (int i = 0; i < 90; ++i) lying.step();
    for (sim::PointConstraint& tie : definition.constraints) tie.breaking_force = 20;
    sim::World one(definition);
    one.rewind(lying.snapshot());
    std::vector<sim::World> worlds;
    for (int p = 0; p < 2; ++p) worlds.emplace_back(definition).rewind(lying.snapshot());
    std::vector<int> whose;
    for (int i = 0; i < one.bodies(); ++i) whose.push_back(i < 80 ? 0 : 1);
    int told = 0;
    for (int step = 0; step < 10; ++step) {
        one.step();
        told += step_all(worlds, whose);
        for (const sim::World& world : worlds) {
            ASSERT_EQ(world.state_hash(), one.state_hash()) << step;
            EXPECT_EQ(world.counts().constraints_broken, one.counts().constraints_broken) << step;
            EXPECT_EQ(world.broken().size(), one.broken().size()) << step;
        }
    }
    EXPECT_GT(one.counts().constraints_broken, 0u);
    EXPECT_GT(told, 0) << "it is swept together";
}

TEST(Partners, BodiesThatSleepWakeAndBreakLooseHaveTheBitsOfOneWorld) {
    const sim::WorldDefinition definition = sleepers_and_ties();
    const Steps one = alone(definition, 700);
    int slept = 0, woke = 0;
    for (const sim::WorldCounts& counts : one.counts) {
        woke += counts.asleep < slept;
        slept = std::max(slept, counts.asleep);
    }
    EXPECT_GE(slept, 4);
    EXPECT_GT(woke, 0);
    EXPECT_GT(one.counts.back().constraints_broken, 0u);
    for (const int partners : {2, 7}) {
        const Steps several = together(
            definition, 700, partners, [&](int step, int body) { return (body + step / 3) % partners; },
            kNeverSilent);
        EXPECT_EQ(several.hashes, one.hashes) << partners;
        EXPECT_EQ(several.alone, 0);
    }
}

// One is broken as the step begins, one leaves the world's range within it: nobody's neighbours notice, whoever owns them.
TEST(Partners, BrokenBodiesAreTakenOutByAll) {
    sim::WorldDefinition definition = pile();
    for (sim::WorldBody& body : definition.bodies)
        body.restitution = 0, body.motion.clear(), body.velocity.setZero();
    definition.bodies.push_back(ball({0, 1e7 - 5, 0}, sim::Fidelity::rigid));
    const int away = int(definition.bodies.size()) - 1, within = 17;
    definition.bodies.back().velocity.y() = 100;  // out of range in the fourth step
    sim::World one(definition);
    std::vector<sim::World> worlds;
    for (int p = 0; p < 3; ++p) worlds.emplace_back(definition);
    std::vector<int> whose;
    for (int i = 0; i < one.bodies(); ++i) whose.push_back(i % 3);
    for (int step = 0; step < 20; ++step) {
        if (step == 10) {
            sim::WorldBodyState state = one.state(within);
            state.q_dot[2] = 1e200;
            one.set_state(within, state);
            for (sim::World& world : worlds) world.set_state(within, state);
        }
        one.step();
        Mail mail(3);
        std::vector<std::thread> threads;
        std::atomic<int> gave_up = 0;
        for (int p = 0; p < 3; ++p)
            threads.emplace_back([&, p] {
                ThreadPartner partner(mail, p, whose, -1);
                try {
                    worlds[std::size_t(p)].step_together(partner);
                } catch (const sim::NotTogether&) {
                    ++gave_up;
                    mail.give_up();
                    step_alone(worlds[std::size_t(p)]);
                }
            });
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(gave_up, 0) << step;
        for (const sim::World& world : worlds) {
            ASSERT_EQ(world.state_hash(), one.state_hash()) << step;
            ASSERT_EQ(world.quarantined().size(), one.quarantined().size()) << step;
        }
    }
    ASSERT_EQ(one.quarantined().size(), 2u);
    EXPECT_EQ(one.quarantined()[0].body, away);
    EXPECT_EQ(one.quarantined()[1].body, within);
    for (const sim::World& world : worlds)
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(world.quarantined()[i].body, one.quarantined()[i].body);
            EXPECT_EQ(world.quarantined()[i].step, one.quarantined()[i].step);
            EXPECT_EQ(world.quarantined()[i].what, one.quarantined()[i].what);
        }
}

TEST(Partners, AStepInWhichOneFallsSilentIsDoneAlone) {
    sim::WorldDefinition definition = pile();
    const int steps = 40;
    const Steps one = alone(definition, steps),
                several = together(
                    definition, steps, 3, [](int, int body) { return body % 3; },
                    [](int step, int partner) { return partner == step % 3 ? step / 2 : -1; });
    EXPECT_EQ(several.hashes, one.hashes);
    EXPECT_GT(several.alone, 5);
}

// A world that was rewound has not posed those that sleep: one that is woken falls onto the next.
TEST(Partners, SleepersThatARewoundWorldWakesMeetThoseOfOthers) {
    sim::WorldDefinition definition = on_floor();
    definition.settings.sleep_speed = 0.1;
    for (int i = 0; i < 2; ++i)
        definition.bodies.push_back(ball({0, 0.25 + 0.5034 * i, 0}, sim::Fidelity::rigid, 0.25, 300));
    definition.bodies.push_back(ball({0, 3, 0}, sim::Fidelity::rigid, 0.2, 300));
    const sim::World start(definition);
    sim::WorldSnapshot asleep = start.snapshot();
    asleep.step = 1;
    for (int i = 0; i < 2; ++i) {
        asleep.bodies[std::size_t(i)].asleep = true;
        asleep.bodies[std::size_t(i)].sleep_group = i;
    }
    asleep.bodies[2].state.position.y() = 1.22;
    asleep.bodies[2].state.velocity.y() = -2;
    sim::World one(definition);
    one.rewind(asleep);
    std::vector<sim::World> worlds;
    for (int p = 0; p < 2; ++p) worlds.emplace_back(definition).rewind(asleep);
    int met = 0;
    for (int step = 0; step < 20; ++step) {
        one.step();
        met = std::max(met, one.counts().contacts);
        (void)step_all(worlds, {0, 1, 1});
        for (const sim::World& world : worlds) ASSERT_EQ(world.state_hash(), one.state_hash()) << step;
    }
    EXPECT_GE(met, 3);
}

namespace {
/// A step of two worlds, of which one hears what is damaged; how often that one refuses it. Both then do the step alone.
int step_with_damage(std::vector<sim::World>& worlds, const std::vector<int>& whose, int hearer,
                     const Damage& damage) {
    Mail mail(2);
    int refused = 0;
    std::vector<std::thread> threads;
    for (int p = 0; p < 2; ++p)
        threads.emplace_back([&, p] {
            ThreadPartner partner(mail, p, whose, -1, p == hearer ? damage : Damage{});
            try {
                worlds[std::size_t(p)].step_together(partner);
            } catch (const std::runtime_error&) {
                mail.give_up();
                refused += p == hearer;
                step_alone(worlds[std::size_t(p)]);
            }
        });
    for (std::thread& thread : threads) thread.join();
    return refused;
}
}  // namespace

// Places of bodies that are there, but do not move.
TEST(Partners, ContactsOfWhatDoesNotMoveAreRefused) {
    sim::WorldDefinition definition = on_floor();
    definition.bodies = {box({0, 0.5, 0}, {0.5, 0.5, 0.5}), box({0, 1.4, 0}, {0.4, 0.4, 0.4})};
    definition.bodies[0].fixed = true;
    definition.bodies.push_back(box({5, 0.4, 0}, {0.4, 0.4, 0.4}));
    std::vector<sim::World> worlds;
    for (int p = 0; p < 2; ++p) worlds.emplace_back(definition);
    // The first contact's first body, after their number: body 2 on the plane becomes body 0.
    const int refused = step_with_damage(worlds, {0, 0, 1}, 0, [](sim::Partners::Bytes& bytes) {
        if (bytes.size() > 8) bytes[4] = 0;
    });
    EXPECT_EQ(refused, 1);
    EXPECT_EQ(worlds[0].state_hash(), worlds[1].state_hash());
}

namespace {
/// Two pairs of balls that are about to collide, one pair a partner. Damage: to what the second hears of the first one's pair.
struct Collisions {
    std::vector<sim::World> worlds;
    int refused = 0;
    std::size_t told = 0;  // bytes of the message

    explicit Collisions(const Damage& damage) {
        sim::WorldDefinition definition = weightless();
        for (const double x : {0., 20.})
            for (const double side : {-1., 1.}) {
                definition.bodies.push_back(ball({x + 0.6 * side, 0, 0}, sim::Fidelity::rigid, 0.5));
                definition.bodies.back().velocity = {-20 * side, 0, 0};
            }
        for (int p = 0; p < 2; ++p) worlds.emplace_back(definition);
        bool first = true;
        refused = step_with_damage(worlds, {0, 0, 1, 1}, 1, [&](sim::Partners::Bytes& bytes) {
            if (std::exchange(first, false)) told = bytes.size(), damage(bytes);
        });
    }
    [[nodiscard]] bool equal() const { return worlds[0].state_hash() == worlds[1].state_hash(); }
};
}  // namespace

// What is heard begins with no contact, 4 bytes, and one meeting, 4: its bodies, 4 each, its time, 8, whether its impact
// follows, 1, and that as a contact: bodies, counts and numbers, 22, then its point, 100: after 12 when it begins, 4.
TEST(Partners, ImpactsAreTakenFromWhoFoundThemUnlessTheyCannotBe) {
    constexpr std::size_t kA = 8, kB = 12, kTime = 16, kFlag = 24, kImpact = 25, kBegins = 59, kEnd = 147;
    Collisions whole([](sim::Partners::Bytes&) {});
    ASSERT_GE(whole.told, kEnd);
    EXPECT_TRUE(whole.equal());
    EXPECT_EQ(whole.refused, 0);
    EXPECT_LT(whole.worlds[1].state(0).velocity.norm(), 19) << "else nothing meets";
    const auto is_refused = [](const Damage& damage) {
        const Collisions run(damage);
        EXPECT_TRUE(run.equal());  // done alone
        return run.refused == 1;
    };
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) {
        bytes[kFlag] = 0;
        bytes.erase(bytes.begin() + kImpact, bytes.begin() + kEnd);
    })) << "who is told of no impact believes it, and other islands come of that";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) { bytes[kTime + 7] |= 0x80; }))
        << "before the step";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) { bytes[kTime + 7] = 0x40; })) << "after it";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) { bytes[kFlag] = 2; })) << "neither yes nor no";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) { bytes[kImpact + 4] = 2; })) << "of another pair";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) { bytes[kBegins + 2] ^= 0x01; }))
        << "at another time";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) {
        const float never = std::numeric_limits<float>::infinity();
        std::memcpy(bytes.data() + kBegins, &never, sizeof never);
    })) << "never";
    EXPECT_TRUE(is_refused([](sim::Partners::Bytes& bytes) {
        bytes[kA] = bytes[kImpact] = 2, bytes[kB] = bytes[kImpact + 4] = 3;
    })) << "of a pair that the hearer found, too";
}

// Numbers may be lies; places, counts and what is not finite are found, and then the world is what it was.
TEST(Partners, DamagedPartsEndTheStepAndCrashNobody) {
    std::mt19937 random(5);
    int found = 0;
    for (int run = 0; run < 60; ++run) {
        const sim::WorldDefinition definition = run % 3 == 0 ? pile() : random_scene(unsigned(run));
        std::vector<sim::World> worlds;
        std::vector<int> whose;
        for (int p = 0; p < 2; ++p) worlds.emplace_back(definition);
        for (int body = 0; body < worlds[0].bodies(); ++body) whose.push_back(body % 2);
        sim::World one(definition);
        for (int step = 0; step < 4; ++step) {
            one.step();
            Mail mail(2);
            std::array<bool, 2> gave_up{};
            std::vector<std::thread> threads;
            const unsigned seed = random();
            for (int p = 0; p < 2; ++p)
                threads.emplace_back([&, p] {
                    std::mt19937 own(seed);
                    ThreadPartner partner(mail, p, whose, -1, [&](sim::Partners::Bytes& bytes) {
                        if (p == 0 || step < 3 || bytes.empty()) return;
                        for (unsigned n = 1 + own() % 4; n > 0; --n)
                            bytes[own() % bytes.size()] = static_cast<std::uint8_t>(own());
                        if (own() % 4 == 0) bytes.resize(own() % bytes.size());
                    });
                    try {
                        worlds[std::size_t(p)].step_together(partner);
                    } catch (const std::runtime_error&) {  // NotTogether, DecodeError
                        mail.give_up();
                        gave_up[std::size_t(p)] = true;
                        step_alone(worlds[std::size_t(p)]);
                    }
                });
            for (std::thread& thread : threads) thread.join();
            if (!gave_up[1]) continue;
            ++found;
            EXPECT_EQ(worlds[1].state_hash(), one.state_hash()) << "run " << run;
        }
    }
    EXPECT_GT(found, 20);
}

}  // namespace
