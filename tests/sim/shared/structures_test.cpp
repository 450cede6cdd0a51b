#include "shared/structures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "shared_scenes.h"

using namespace world_test;

namespace {

using Bodies = std::vector<std::vector<int>>;

std::vector<int> all_of(const sim::World& world) {
    std::vector<int> bodies(static_cast<std::size_t>(world.bodies()));
    std::iota(bodies.begin(), bodies.end(), 0);
    return bodies;
}

Bodies structures_of(const sim::WorldDefinition& definition, double size = 1) {
    const sim::SharedWorld world(definition);
    return sim::structures(world, all_of(world), size);
}

/// A beam over pillars of boxes of this side.
sim::WorldDefinition gate(double side, int pillars, int high, double from_x = 0) {
    sim::WorldDefinition d = on_floor();
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(side / 2);
    for (int i = 0; i < pillars; ++i)
        for (int k = 0; k < high; ++k)
            d.bodies.push_back(box({from_x + 2 * side * i, side * (k + 0.5), 0}, half, 1000));
    const double length = side * (2 * pillars - 1);
    d.bodies.push_back(
        box({from_x + side * (pillars - 1), side * (high + 0.5), 0}, {length / 2, side / 2, side / 2}, 1000));
    return d;
}

/// How far a body of the world is from where the scene has it, at most [m].
class Moved : public Record {
public:
    void at(std::uint64_t step, const sim::World& world) override {
        Record::at(step, world);
        for (int i = 0; i < world.bodies(); ++i) {
            const sim::WorldBody& body = world.definition(i);
            most = std::max(most, (world.state(i).position - body.world_from_body.translation()).norm());
            fastest = std::max(fastest, world.state(i).velocity.norm());
        }
    }
    double most = 0, fastest = 0;
};

sim::DistributedSettings bounded(std::uint64_t steps, int bound) {
    sim::DistributedSettings settings = for_steps(steps);
    settings.bound = bound;
    return settings;
}

}  // namespace

TEST(Structures, AreBodiesOnAndBesideEachOther) {
    EXPECT_EQ(structures_of(gate(1, 3, 4)).size(), 1u);
    EXPECT_EQ(structures_of(gate(1, 3, 4))[0].size(), 13u);
    sim::WorldDefinition d = on_floor();
    for (const double gap : {0.01, 0.03}) {  // of a size of 1 m: 2 %
        d.bodies = {box({0, 0.5, 0}, {0.5, 0.5, 0.5}), box({1 + gap, 0.5, 0}, {0.5, 0.5, 0.5})};
        EXPECT_EQ(structures_of(d).size(), gap < 0.02 ? 1u : 0u) << gap;
    }
}

// The box around a ball is the same however the ball is turned.
TEST(Structures, BoxesAroundBodiesFollowTheirShapeAndTurn) {
    Draw draw(5);
    for (int trial = 0; trial < 50; ++trial) {
        sim::WorldDefinition d = on_floor();
        for (const double x : {0.0, 1.05}) {
            d.bodies.push_back(ball({x, 0.5, 0}));
            d.bodies.back().world_from_body.rotate(
                Eigen::AngleAxisd(draw.between(0, 3),
                                  Eigen::Vector3d(draw.between(-1, 1), draw.between(-1, 1), 1).normalized()));
        }
        EXPECT_TRUE(structures_of(d).empty());
    }
    // A board reaches 0.9 m to either side, and turned by a quarter as far the other way.
    for (const bool turned : {false, true}) {
        sim::WorldDefinition d = on_floor();
        d.bodies = {box({0, 0.1, 0}, {0.9, 0.1, 0.1}), box({1, 0.1, 0}, {0.1, 0.1, 0.1})};
        if (turned)
            d.bodies[0].world_from_body.rotate(
                Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
        EXPECT_EQ(structures_of(d).size(), turned ? 0u : 1u);
    }
}

TEST(Structures, AreSlowSmallAndHardlyTouchedByOthers) {
    sim::WorldDefinition d = gate(1, 3, 4);
    for (sim::WorldBody& body : d.bodies) body.velocity = {2, 0, 0};  // a quarter of sqrt(9.81): 0.78 m/s
    EXPECT_TRUE(structures_of(d).empty());
    // One that stands may have more than one whose bodies lie turned by 20 degrees.
    for (const bool turned : {false, true})
        for (const int pillars : {15, 16, 63, 64}) {
            sim::WorldDefinition pillars_on_floor = gate(1, pillars, 4);
            for (sim::WorldBody& body : pillars_on_floor.bodies)
                if (turned) body.world_from_body.rotate(Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitX()));
            const std::size_t most = turned ? sim::kMostInStructure : sim::kMostStanding;
            EXPECT_EQ(structures_of(pillars_on_floor).size(), pillars * 4u + 1 <= most ? 1u : 0u)
                << turned << pillars;
        }
    // Two pillars of a beam that another owner has: a body of others touches four own ones at each.
    for (const int high : {4, 3}) {
        const sim::WorldDefinition shared = gate(1, 2, high);
        sim::SharedWorld world(shared);
        const int beam = world.bodies() - 1;
        world.set_own(beam, false);
        std::vector<int> own = all_of(world), near;
        own.pop_back();
        const sim::WorldBodyState state = sim::World(shared).state(beam);
        world.near_own({{beam, state.position, 4}}, near);
        ASSERT_EQ(near, std::vector<int>{beam});
        world.place_ghost(beam, state, nullptr);
        world.step();
        ASSERT_EQ(world.cross_impulses().size(), 2u);
        EXPECT_EQ(sim::structures(world, own, 1).size(), high == 4 ? 2u : 0u);
    }
}

// Boxes one above the other: within 0.2 s each falls by 0.2 m, to where the next one is.
TEST(Structures, OfFlatBodiesAreAlsoThoseThatFallIntoPlace) {
    sim::WorldDefinition d = on_floor();
    for (int i = 0; i < 4; ++i) d.bodies.push_back(box({0, 1 + 1.2 * i, 0}, {0.5, 0.5, 0.5}));
    d.bodies.push_back(box({1.15, 1, 0}, {0.5, 0.5, 0.5}));  // beside them, and falls so
    const auto found = [&](double within_s) {
        const sim::SharedWorld world(d);
        return sim::flat_structures(world, all_of(world), 1, within_s);
    };
    EXPECT_TRUE(found(0.1).empty());  // by 0.05 m
    EXPECT_EQ(found(0.2), (Bodies{{0, 1, 2, 3}}));
    d.bodies[4].velocity = {-0.8, 0, 0};
    EXPECT_EQ(found(0.2), (Bodies{{0, 1, 2, 3, 4}}));
    for (sim::WorldBody& body : d.bodies) body.velocity.y() -= 10;  // however fast
    EXPECT_EQ(found(0.2), (Bodies{{0, 1, 2, 3, 4}}));
    // Others' bodies count, but are not given.
    const sim::SharedWorld world(d);
    const std::vector<int> own = {0, 1};
    const std::vector<sim::OthersBody> others = {{2, false, world.state(2)}, {3, false, world.state(3)}};
    EXPECT_EQ(sim::flat_structures(world, own, 1, 0.2, others), (Bodies{{0, 1}}));
    const std::vector<sim::OthersBody> many(sim::kMostStanding - 1, others[0]);
    EXPECT_TRUE(sim::flat_structures(world, own, 1, 0.2, many).empty());
    // Nothing can stand on balls. Drums stand on their ends, and lie on their sides.
    for (sim::WorldBody& body : d.bodies) body.shape.base.e1 = body.shape.base.e2 = 1;
    EXPECT_TRUE(found(0.2).empty());
    for (sim::WorldBody& body : d.bodies) body.shape.base.e1 = 0.1;
    EXPECT_EQ(found(0.2), (Bodies{{0, 1, 2, 3, 4}}));
    d.settings.gravity.setZero();
    EXPECT_TRUE(found(0.2).empty());
}

// Bricks on a floor, a twentieth of their size apart, and one that flies past their corner: it is never near.
TEST(Structures, OfFlatBodiesAreNotThoseThatLieApartOrPassBy) {
    sim::WorldDefinition d = on_floor();
    for (int i = 0; i < 9; ++i)
        d.bodies.push_back(box({1.05 * (i % 3), 0.5, 1.05 * (i / 3)}, {0.5, 0.5, 0.5}));
    d.bodies.push_back(box({6, 0.5, -2}, {0.5, 0.5, 0.5}));
    const auto found = [&] {
        const sim::SharedWorld world(d);
        return sim::flat_structures(world, all_of(world), 1, 0.2);
    };
    EXPECT_TRUE(found().empty());
    d.bodies.back().velocity = {40, 0, 40};  // away from them
    EXPECT_TRUE(found().empty());
    d.bodies.back().world_from_body.translation() = Eigen::Vector3d(-6, 0.5, 4);
    d.bodies.back().velocity = {40, 0, 40};  // passes at 4 m and more
    EXPECT_TRUE(found().empty());
    d.bodies.back().velocity = {40, 0, -20};  // right at them
    EXPECT_EQ(found().size(), 1u);
}

// A gate whose beam comes last; a shower of boxes from one place is none.
TEST(Structures, ThatEventsCompleteArePlannedUntilAllHasCome) {
    sim::WorldScene scene;
    scene.world = gate(1, 2, 2);
    scene.later = {scene.world.bodies.back()};
    scene.world.bodies.pop_back();
    for (const bool shower : {false, true}) {
        if (shower) scene.later.assign(3, box({0, 9, 0}, {0.5, 0.5, 0.5}));
        const sim::StructureFinder finder(scene, 1, 0.2);
        sim::SharedWorld world(scene.world);
        EXPECT_EQ(finder.flat(world, {}), (shower ? Bodies{} : Bodies{{0, 1, 2, 3, 4}}));
        for (const sim::WorldBody& body : scene.later) (void)world.add_body(body);
        EXPECT_TRUE(finder.flat(world, {}).empty());
    }
}

TEST(Structures, JoinLotsDirectlyAndThroughOthers) {
    const std::vector<std::vector<int>> lots = {{0, 3}, {1}, {2}, {4, 6}, {5}};
    EXPECT_EQ(sim::joined_by({}, lots), (std::vector<int>{0, 1, 2, 3, 4}));
    EXPECT_EQ(sim::joined_by({{2, 3}, {0, 6}}, lots), (std::vector<int>{0, 1, 0, 0, 4}));
}

TEST(Structures, BodiesThatDifferMuchInMassOrLengthAreUnlikeUnlessAStructureHasThem) {
    const auto alike = [](const std::vector<sim::WorldBody>& bodies, const Bodies& structures = {}) {
        sim::WorldDefinition d = on_floor();
        d.bodies = bodies;
        const sim::SharedWorld world(d);
        Bodies lots;
        for (const int body : all_of(world)) lots.push_back({body});
        return sim::are_alike(world, lots, structures);
    };
    const sim::WorldBody small = ball({0, 1, 0}), heavy = ball({0, 3, 0}, sim::Fidelity::rigid, 0.5, 410),
                         nearly = ball({0, 3, 0}, sim::Fidelity::rigid, 0.5, 390),
                         long_one = box({0, 5, 0}, {1.6, 0.1, 0.1}, 800);
    EXPECT_TRUE(alike({}));
    EXPECT_TRUE(alike({small, nearly}));
    EXPECT_FALSE(alike({small, heavy}));
    EXPECT_FALSE(alike({small, long_one}));
    EXPECT_TRUE(alike({heavy, long_one}, {{0, 1}}));
    EXPECT_FALSE(alike({small, heavy, long_one}, {{1, 2}}));  // it may fall on them
}

// What several workers hold boundedly out of step sways, and falls. So it is all at one of them, whoever comes and goes.
TEST(Structures, StandOutOfStepAsInOneProcessAndAreNeverSoldInParts) {
    for (const double side : {0.05, 0.4})
        for (const int workers : {2, 5}) {
            sim::WorldScene scene;
            scene.world = gate(side, 4, 5);
            for (const sim::WorldBody& body : gate(side, 3, 3, 20 * side).bodies)
                scene.world.bodies.push_back(body);
            scene.world.settings.dt = 1.0 / 120;
            double half_way = 0;
            for (const int killed : {-1, 0, 1}) {
                Moved record;
                sim_bench::SimulatedProcessors how = processors(workers);
                if (killed >= 0) {
                    how.failures = {{half_way, killed, sim_bench::SimulatedProcessors::Failure::Kind::kill}};
                    how.silence_s = half_way / 8;
                }
                const sim::DistributedResult result =
                    sim_bench::simulate_processors(scene, bounded(480, 4), how, record);
                half_way = result.elapsed_s / 2;
                EXPECT_EQ(result.steps, 480u);
                EXPECT_EQ(result.lost, killed < 0 ? 0 : 1);
                EXPECT_LT(record.most, 0.02 * side) << side << " " << workers;  // settles by less
                for (const Record::Move& move : record.moves)
                    EXPECT_TRUE(move.bodies == 21 || move.bodies == 10 || move.bodies == 31) << move.bodies;
            }
        }
}

// Also where bodies come so deep into each other, at 4 m/s, that ghosts would be parted.
TEST(Structures, AWorkerThatOwnsAllStepsThemAsOneProcess) {
    sim::WorldDefinition d = on_floor();
    d.settings.dt = 1.0 / 120;
    for (int i = 0; i < 14; ++i)
        d.bodies.push_back(
            box({0.204 * (i % 4) + 0.05 * (i / 4 % 2), 0.15 + 0.35 * (i / 4), 0}, {0.1, 0.05, 0.05}, 1000));
    sim::World alone(d);
    sim::SharedWorld shared(d);
    for (int step = 0; step < 120; ++step) {
        alone.step(), shared.step();
        ASSERT_EQ(alone.state_hash(), shared.state_hash()) << step;
    }
}

// Rows of a pyramid that fall onto each other from so high that they are no structure at first, and others that events add: they
// came to several owners, swayed, sank into each other, and fell.
TEST(Structures, ThatFormOutOfStepAreGatheredByOneWorkerAndStandAsInOneProcess) {
    int gathered = 0;
    for (const bool added : {false, true})
        for (const double side : {0.1, 0.4})
            for (const int bound : {1, 8}) {
                sim::WorldScene scene;
                scene.world = on_floor();
                scene.world.settings.dt = 1.0 / 120;
                const Eigen::Vector3d half(side, side / 2, side / 2);
                for (int row = 0; row < 4; ++row)
                    for (int i = 0; i < 4 - row; ++i) {
                        // Too far apart to belong together as they begin, but for some.
                        const sim::WorldBody brick =
                            box({2.3 * side * (i + 0.5 * row),
                                 side * (row + 0.5 + 0.6 * (added ? 1 : row + 1)), 0},
                                half, 1000);
                        if (added && row > 0) {
                            scene.later.push_back(brick);
                            const std::size_t n = scene.later.size();
                            scene.events.push_back({20 + 10 * n, {}, n - 1, n, {}});
                        } else {
                            scene.world.bodies.push_back(brick);
                        }
                    }
                const std::uint64_t steps = 300;
                const sim::World expected = alone(scene, steps);
                double end = 0;
                for (const int killed : {-1, 0}) {
                    SCOPED_TRACE(std::to_string(added) + " " + std::to_string(side) + " " +
                                 std::to_string(bound) + " " + std::to_string(killed));
                    struct Last : Record {
                        void at(std::uint64_t step, const sim::World& world) override {
                            Record::at(step, world);
                            if (step != 300) return;
                            for (int i = 0; i < world.bodies(); ++i)
                                places.push_back(world.state(i).position);
                        }
                        std::vector<Eigen::Vector3d> places;
                    } record;
                    sim_bench::SimulatedProcessors how = processors(3);
                    sim::DistributedSettings settings = bounded(steps, bound);
                    settings.market.trade = side < 0.2;  // with and without balancing
                    if (killed >= 0) {
                        // While it falls.
                        how.failures = {
                            {end / 6, killed, sim_bench::SimulatedProcessors::Failure::Kind::kill}};
                        how.silence_s = end / 100;
                    }
                    const sim::DistributedResult result =
                        sim_bench::simulate_processors(scene, settings, how, record);
                    end = killed < 0 ? result.elapsed_s : end;
                    EXPECT_EQ(result.steps, steps);
                    ASSERT_EQ(record.places.size(), 10u);
                    for (int i = 0; i < 10; ++i) {
                        const Eigen::Vector3d& place = record.places[std::size_t(i)];
                        EXPECT_GT(place.y(), 0.4 * side) << i << " is in the floor";
                        // What fell moved by a side and more. What a lost worker had goes on from rounded states, so where
                        // bricks bounce it goes another way.
                        if (killed < 0) {
                            EXPECT_LT((place - expected.state(i).position).norm(), 0.25 * side) << i;
                        }
                    }
                    const auto owners = std::ranges::count_if(
                        record.own, [](const auto& worker) { return worker.second > 0; });
                    EXPECT_EQ(owners, 1);
                    gathered += static_cast<int>(result.trades);
                }
            }
    EXPECT_GE(gathered, 3);  // others have one owner from the start
}

// The application sees the wall, and so does its owner, who would else sell it piece by piece, and get it back.
TEST(Structures, AmongBallsAreNotSoldAndGatheredAgainForEver) {
    sim::WorldScene scene;
    scene.world = on_floor();
    for (const double side : {-1.0, 1.0}) {
        scene.world.planes.push_back({Eigen::Vector3d(side, 0, 0), -1.1});
        scene.world.planes.push_back({Eigen::Vector3d(0, 0, side), -0.7});
    }
    for (int i = 0; i < 12; ++i)
        scene.world.bodies.push_back(
            box({0.41 * (i % 4) - 0.6 + 0.2 * (i / 4 % 2), 0.1 + 0.2 * (i / 4), 0}, {0.2, 0.1, 0.1}, 500));
    for (int i = 0; i < 80; ++i)
        scene.world.bodies.push_back(
            ball({-0.9 + 0.23 * (i % 8), 0.12 + 0.23 * (i / 16), i / 8 % 2 ? 0.35 : -0.35},
                 sim::Fidelity::rigid, 0.1, 500));
    std::uint64_t trades[2];
    for (const int late : {0, 1}) {
        Moved record;
        trades[late] =
            sim_bench::simulate_processors(scene, bounded(late ? 600 : 300, 4), processors(3), record).trades;
    }
    EXPECT_LE(trades[1], trades[0] + 4);  // balls may still be sold; the wall went to and fro eight times
}

// Each worker would answer for the whole of the board, some steps late: it was thrown up at 50 m/s and more.
TEST(Structures, ABoardThatFallsOnAHeapIsNotThrownUpOutOfStep) {
    sim::WorldScene scene;
    scene.world = on_floor();
    Draw draw(3);
    for (int i = 0; i < 75; ++i)
        scene.world.bodies.push_back(
            ball({0.12 * (i % 5) + draw.between(-0.005, 0.005), 0.06 + 0.12 * (i / 25),
                  0.12 * (i / 5 % 5) + draw.between(-0.005, 0.005)},
                 sim::Fidelity::rigid, 0.05, 1000));
    scene.world.bodies.push_back(box({0.24, 0.6, 0.24}, {0.3, 0.1, 0.3}, 1000));
    for (const bool here : {true, false}) {
        if (!here) {
            scene.later = {scene.world.bodies.back()};
            scene.world.bodies.pop_back();
            scene.events = {{20, {}, 0, 1, {}}};
        }
        Moved record;
        const sim::DistributedResult result =
            sim_bench::simulate_processors(scene, bounded(120, 4), processors(5), record);
        EXPECT_EQ(result.steps, 120u);
        EXPECT_EQ(result.trades, 0u);
        EXPECT_TRUE(result.one_owner);
        EXPECT_LT(record.fastest, 5);  // falls by 0.35 m: 2.6 m/s, and slides down
        // Whoever leaves, also before the board comes: all bodies go to one other worker.
        sim_bench::SimulatedProcessors how = processors(5);
        for (int worker = 0; worker < 4; ++worker)
            how.failures.push_back({result.elapsed_s * (worker + 1) / 24, worker,
                                    sim_bench::SimulatedProcessors::Failure::Kind::drain});
        Moved drained;
        EXPECT_EQ(sim_bench::simulate_processors(scene, bounded(120, 4), how, drained).steps, 120u);
        EXPECT_EQ(drained.own[4], 76);
        EXPECT_LT(drained.fastest, 5);
    }
}
