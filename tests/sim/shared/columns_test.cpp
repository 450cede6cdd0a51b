#include "shared/columns.h"

#include <gtest/gtest.h>

#include <set>

#include "shared/initial_partition.h"
#include "shared_scenes.h"

using namespace world_test;

namespace {

using Places = std::vector<std::optional<Eigen::Vector3d>>;

sim::WorldScene balls(int count) {
    sim::WorldScene scene;
    scene.world = on_floor();
    for (int i = 0; i < count; ++i) scene.world.bodies.push_back(ball({1.1 * i, 0.5, 0}));
    return scene;
}

}  // namespace

TEST(Columns, AStackIsOneColumnWhereverItStandsAlsoOnBordersAndCorners) {
    const sim::Columns columns(balls(10));
    EXPECT_DOUBLE_EQ(columns.side(), 1);
    Draw draw(14);
    for (int trial = 0; trial < 300; ++trial) {
        // Every third on a corner of columns, every third on a border.
        const Eigen::Vector2d at(trial % 3 == 2 ? draw.between(-3, 3) : trial % 5,
                                 trial % 3 > 0 ? draw.between(-3, 3) : trial % 7);
        Places places;
        for (int i = 0; i < 10; ++i)
            places.emplace_back(Eigen::Vector3d(at.x() + draw.between(-0.05, 0.05), 9.5 - i,
                                                at.y() + draw.between(-0.05, 0.05)));
        std::vector<std::optional<sim::Column>> column(places.size());
        columns.assign(places, column);
        for (const auto& one : column) EXPECT_EQ(one, column[0]) << at.transpose();
    }
}

TEST(Columns, ABodyThatGoesToAndFroAcrossABorderKeepsItsColumn) {
    const sim::Columns columns(balls(10));
    std::vector<std::optional<sim::Column>> column(1);
    columns.assign(Places{Eigen::Vector3d(0.4, 0.5, 0.4)}, column);
    const sim::Column first = *column[0];
    for (const double x : {0.9, 1.24, -0.24, 1.2, 0.1}) {
        columns.assign(Places{Eigen::Vector3d(x, 0.5, 0.4)}, column);
        EXPECT_EQ(*column[0], first) << x;
    }
    columns.assign(Places{Eigen::Vector3d(1.26, 0.5, 0.4)}, column);
    const sim::Column second = *column[0];
    EXPECT_NE(second, first);
    for (const double x : {0.9, 0.76, 1.5}) {  // now the border is soft the other way
        columns.assign(Places{Eigen::Vector3d(x, 0.5, 0.4)}, column);
        EXPECT_EQ(*column[0], second) << x;
    }
}

TEST(Columns, FirstOwnersOfRandomPilesCutNoStackAndShareOutEvenly) {
    Draw draw(400);
    for (int workers = 1; workers <= 10; ++workers) {
        const sim::WorldScene scene = balls(400);
        const sim::Columns columns(scene);
        std::vector<Eigen::Vector3d> places;
        for (int i = 0; i < 400; ++i)
            places.emplace_back(draw.between(-6, 6), 0.5 + i % 4, draw.between(-6, 6));
        const auto lots = sim::tied_groups(scene);
        const std::vector<int> owner = first_owners(columns, lots, places, workers);
        std::vector<std::optional<sim::Column>> column(places.size());
        columns.assign(Places(places.begin(), places.end()), column);
        std::map<sim::Column, int> owner_of;
        std::vector<int> bodies(static_cast<std::size_t>(workers));
        for (std::size_t i = 0; i < lots.size(); ++i) {
            EXPECT_EQ(owner_of.try_emplace(*column[i], owner[i]).first->second, owner[i]);
            ++bodies[static_cast<std::size_t>(owner[i])];
        }
        // A column has 2.8 bodies in the mean; each of four cuts misses by half of one, some have more.
        for (const int count : bodies) EXPECT_NEAR(count, 400.0 / workers, 10) << workers;
    }
}

TEST(Columns, LotsAreAllThatAWorkerHasInAColumnAndWhatASaleShortensItsReturnLengthens) {
    const sim::WorldScene scene = balls(120);
    Draw draw(7);
    std::vector<std::uint32_t> owner(120);
    std::vector<Eigen::Vector3d> places;
    for (std::uint32_t& one : owner) {
        one = static_cast<std::uint32_t>(draw.between(0, 3));
        places.emplace_back(draw.between(0, 6), draw.between(0.5, 3), draw.between(0, 6));
    }
    sim::SharedWorld world(scene.world);
    const sim::BodyCosts costs(120);
    const auto place = [&](int body) { return places[static_cast<std::size_t>(body)]; };
    const auto of = [&](std::uint32_t self) {
        for (int body = 0; body < 120; ++body)
            world.set_own(body, owner[static_cast<std::size_t>(body)] == self);
        return sim::ColumnWatch(scene).holdings(self, world, owner, costs, place);
    };
    const sim::Holdings first = of(0);
    std::set<sim::Column> columns;
    std::size_t bodies = 0;
    for (const sim::Holdings::Lot& lot : first.lots()) {
        EXPECT_TRUE(columns.insert(lot.column).second);
        EXPECT_LT(lot.cost, 0);  // none has taken a step
        bodies += lot.bodies.size();
    }
    EXPECT_EQ(bodies, static_cast<std::size_t>(std::count(owner.begin(), owner.end(), 0U)));
    for (const sim::Holdings::Lot& lot : first.lots()) {
        const auto before = owner;
        for (const std::uint32_t body : lot.bodies) owner[body] = 1;
        const sim::Holdings second = of(1);
        const auto back = std::ranges::find(second.lots(), lot.column, &sim::Holdings::Lot::column);
        ASSERT_NE(back, second.lots().end());
        if (back->bodies.size() == lot.bodies.size()) {  // it had nothing there
            EXPECT_EQ(second.border_saved(*back, 0), -first.border_saved(lot, 1));
        }
        owner = before;
    }
}
