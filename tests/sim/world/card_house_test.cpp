#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "world_bodies.h"

// Cards of 2 x 90 x 60 mm (times a scale) that lean on each other: weight alone moves one further in a step than it is thick.

using namespace world_test;

namespace {

constexpr double kFriction = 0.6;

struct CardHouse {
    double scale, lean;
    sim::WorldDefinition definition = on_floor();

    CardHouse(double times, double lean_deg, double dt)
        : scale(times), lean(lean_deg * std::numbers::pi / 180) {
        definition.settings.dt = dt;
        definition.planes[0].friction = kFriction;
    }

    [[nodiscard]] double thick() const { return 0.002 * scale; }
    [[nodiscard]] double length() const { return 0.09 * scale; }
    [[nodiscard]] double height() const { return length() * std::cos(lean) + thick() * std::sin(lean); }
    /// From apex to apex.
    [[nodiscard]] double spacing() const {
        return 2 * (length() * std::sin(lean) + thick() * std::cos(lean)) + 0.004 * scale;
    }

    void add(double x, double y, double angle, const Eigen::Vector3d& size) {
        sim::WorldBody card = box({x, y, 0}, size / 2, 800);
        card.friction = kFriction;
        card.world_from_body.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
        definition.bodies.push_back(card);
    }
    /// Two cards whose upper edges meet over x.
    void tent(double x, double base) {
        for (const int side : {-1, 1}) {
            const double out = (length() * std::sin(lean) + thick() * std::cos(lean)) / 2;
            add(x + side * out, base + height() / 2, side * lean, {thick(), length(), 0.06 * scale});
        }
    }
    /// A card that lies on two neighbouring tents, from `left` to `right`.
    void roof(double left, double right, double base) {
        add((left + right) / 2, base + thick() / 2, 0, {right - left, thick(), 0.06 * scale});
    }
    void build(int storeys) {
        for (int storey = 0; storey < storeys; ++storey) {
            const double base = storey * (height() + thick());
            const int tents = storeys - storey;
            for (int i = 0; i < tents; ++i) tent((i - (tents - 1) / 2.0) * spacing(), base);
            for (int i = 0; i + 1 < tents; ++i) {
                const double middle = (i - (tents - 2) / 2.0) * spacing(),
                             half = spacing() / 2 - 0.0002 * scale;
                roof(middle - half - (i == 0 ? 0.3 * spacing() : 0),
                     middle + half + (i + 2 == tents ? 0.3 * spacing() : 0), base + height());
            }
        }
    }
    /// How far a card is from where it was put, at most, in lengths of one.
    [[nodiscard]] double moved(const sim::World& world) const {
        double most = 0;
        for (std::size_t i = 0; i < definition.bodies.size(); ++i)
            most = std::max(most, (world.state(static_cast<int>(i)).position -
                                   definition.bodies[i].world_from_body.translation())
                                      .norm());
        return most / length();
    }
};

// Edges of exponents 0.1 are rounded: a card that is put down on its corner falls by a twelfth of its half thickness, one
// that leans on others by that of each below. Cards that fall move by a third of their length.
constexpr double kSettled = 0.04;

TEST(CardHouse, ATentStandsOnATableThinOrThick) {
    for (const double table : {0.002, 0.02})
        for (const double dt : {1.0 / 60, 1.0 / 240}) {
            CardHouse house(1, 20, dt);
            house.tent(0, table);
            house.add(0, table / 2, 0, {0.2, table, 0.1});
            house.definition.bodies.back().fixed = true;
            house.definition.settings.sleeping = false;
            sim::World world(house.definition);
            for (int k = 0; k * dt < 3; ++k) world.step();
            EXPECT_LT(house.moved(world), kSettled) << table << " m, " << dt << " s";
        }
}

TEST(CardHouse, OfThreeStoreysStandsFor20Seconds) {
    struct Case {
        double scale, lean, dt;
    };
    for (const Case& c :
         {Case{1, 17, 1.0 / 60}, Case{1, 23, 1.0 / 60}, Case{1, 20, 1.0 / 240}, Case{10, 23, 1.0 / 60}}) {
        CardHouse house(c.scale, c.lean, c.dt);
        house.build(3);
        sim::World world(house.definition);
        for (int k = 0; k * c.dt < 20 && !world.all_asleep(); ++k) world.step();
        EXPECT_LT(house.moved(world), kSettled) << c.scale << ", " << c.lean << " degrees, " << c.dt << " s";
    }
}

}  // namespace
