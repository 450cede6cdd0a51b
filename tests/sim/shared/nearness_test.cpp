#include "shared/nearness.h"

#include <gtest/gtest.h>

#include <random>

namespace sim {
namespace {

/// Numbers from -1 to 1.
class Draw {
public:
    explicit Draw(unsigned seed) : random_(seed) {}
    double operator()() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
    Eigen::Vector3d vector() { return {(*this)(), (*this)(), (*this)()}; }

private:
    std::mt19937 random_;
};

WorldRecord flying(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) {
    WorldRecord record;
    record.state.position = position, record.state.velocity = velocity;
    return record;
}

// Falls, or is held, whatever the other one does.
Eigen::Vector3d later(const WorldRecord& body, double time, double gravity, bool falls) {
    return body.state.position + time * body.state.velocity -
           Eigen::Vector3d(0, falls ? gravity * time * time / 2 : 0, 0);
}

// Of sizes of a centimetre to a metre, at speeds up to 5 sizes a step: what may touch within the time is told.
TEST(Nearness, WhateverMayTouchABodyOfAReachWithinTheTimeMeetsIt) {
    Draw draw(5);
    int touching = 0, told = 0, all = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const double size = std::pow(10, draw()), dt = std::pow(10, -1.5 + 0.5 * draw()),
                     speed = 5 * size / dt * std::pow(10, 1.5 * (draw() - 1)), gravity = 9.81,
                     radius = size / 2;
        const Outlook outlook{6 * dt, dt, gravity};
        std::vector<WorldRecord> bodies;
        for (int i = 0; i < 12; ++i)
            bodies.push_back(flying(6 * size * draw.vector(), speed * draw.vector()));
        const Reach reach = reach_of(bodies, radius, outlook);
        for (int i = 0; i < 12; ++i) {
            const WorldRecord other = flying(12 * size * draw.vector(), speed * draw.vector());
            bool touches = false;
            for (int step = 0; step <= 60; ++step)
                for (const WorldRecord& body : bodies)
                    for (const bool falls : {false, true}) {
                        const double time = outlook.time * step / 60;
                        touches =
                            touches ||
                            (later(body, time, gravity, falls) - later(other, time, gravity, !falls)).norm() <
                                2 * radius;
                    }
            const bool meeting = meets(box_of_way(other.state, radius, outlook), reach);
            EXPECT_TRUE(meeting || !touches) << trial;
            touching += touches, told += meeting, ++all;
        }
    }
    EXPECT_GT(touching, 500);
    EXPECT_LT(told, all * 3 / 4);  // not all are
}

TEST(Nearness, WhatIsFarFromBodiesIsNotNearTheirReachAlsoInTheMidstOfIt) {
    // A ring of bodies of 0.1 m, 4 m wide, and one in its middle.
    std::vector<WorldRecord> ring;
    for (int i = 0; i < 100; ++i)
        ring.push_back(
            flying({2 * std::cos(i * 0.0628), 0, 2 * std::sin(i * 0.0628)}, Eigen::Vector3d::Zero()));
    const Outlook rest{0.1, 1 / 60., 0};
    const Reach reach = reach_of(ring, 0.05, rest);
    const auto near = [&](double x) {
        return meets(box_of_way(flying({x, 0, 0}, Eigen::Vector3d::Zero()).state, 0.05, rest), reach);
    };
    EXPECT_FALSE(near(0));
    EXPECT_FALSE(near(0.9));
    EXPECT_TRUE(near(1.95));
    EXPECT_FALSE(near(2.2));
}

TEST(Nearness, WhatIsNotFiniteIsLeftOut) {
    const Outlook outlook{0.1, 1 / 60., 9.81};
    const double nan = std::nan("");
    const WorldRecord broken = flying({0, nan, 0}, Eigen::Vector3d::Zero()),
                      far = flying({1e300, 0, 0}, {1e300, 0, 0});
    EXPECT_TRUE(box_of_way(broken.state, 1, outlook).isEmpty());
    EXPECT_TRUE(box_of_way(far.state, 1, outlook).isEmpty());
    EXPECT_TRUE(reach_of({broken, far}, 1, outlook).box.isEmpty());
    const Reach one = reach_of({broken, flying({1, 2, 3}, Eigen::Vector3d::Zero())}, 0.5, {0.1, 0, 0});
    EXPECT_EQ(one.box.center(), Eigen::Vector3f(1, 2, 3));
}

}  // namespace
}  // namespace sim
