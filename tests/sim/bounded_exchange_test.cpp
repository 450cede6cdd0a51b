#include <gtest/gtest.h>

#include <deque>

#include "exchange.h"
#include "falling_bodies.h"
#include "world_bodies.h"

// Workers out of step with each other, by hand: messages arrive when the test says so.

namespace sim {
namespace {

class Crew {
public:
    Crew(const WorldDefinition& world, int workers, int bound, std::uint64_t steps,
         const std::vector<int>& owner) {
        SceneMessage scene;
        scene.scene.world = world;
        scene.settings.pace = Pace::bounded;
        scene.settings.bound = bound;
        scene.settings.steps = steps;
        std::vector<std::uint32_t> members;
        for (int i = 0; i < workers; ++i) {
            scene.worker = static_cast<std::uint32_t>(i);
            members.push_back(scene.worker);
            exchanges_.push_back(make_bounded_exchange(scene));
        }
        for (auto& e : exchanges_) e->members(members);
        for (int w = 0; w < workers; ++w) {
            Ownership ownership;
            ownership.owner = static_cast<std::uint32_t>(w);
            for (std::size_t b = 0; b < owner.size(); ++b)
                if (owner[b] == w)
                    ownership.bodies.push_back(exchanges_[0]->world().record(static_cast<int>(b)));
            for (auto& e : exchanges_) e->own(ownership);
        }
        inbox_.resize(static_cast<std::size_t>(workers));
    }
    // One worker does a step if it may.
    bool step(std::size_t w) {
        if (!exchanges_[w]->ready()) return false;
        exchanges_[w]->step();
        const std::vector<std::uint8_t> bytes = exchanges_[w]->publish(0, {});
        bytes_ += bytes.size();
        for (std::size_t i = 0; i < inbox_.size(); ++i)
            if (i != w) inbox_[i].push_back(bytes);
        return true;
    }
    void deliver(std::size_t w) {
        for (; !inbox_[w].empty(); inbox_[w].pop_front()) {
            DecodedWorldMessage message = decode_for_worker(inbox_[w].front());
            exchanges_[w]->take(message.header, std::get<PackedUpdates>(std::move(message.message)));
        }
    }
    void run_in_turn() {
        for (bool any = true; any;) {
            any = false;
            for (std::size_t w = 0; w < exchanges_.size(); ++w) {
                deliver(w);
                any = step(w) || any;
            }
        }
    }
    Exchange& operator[](std::size_t w) { return *exchanges_[w]; }
    [[nodiscard]] std::size_t size() const { return exchanges_.size(); }
    [[nodiscard]] Eigen::Vector3d momentum() const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const auto& e : exchanges_)
            for (int b = 0; b < e->world().bodies(); ++b)
                if (e->world().own(b) && !e->world().definition(b).fixed)
                    sum += e->world().rigid_mass(b).mass * e->world().state(b).velocity;
        return sum;
    }
    [[nodiscard]] Eigen::Vector3d outside() const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const auto& e : exchanges_) sum += e->world().outside_impulse();
        return sum;
    }
    [[nodiscard]] WorldBodyState state(int body) const {
        for (const auto& e : exchanges_)
            if (e->world().own(body)) return e->world().state(body);
        return {};
    }

private:
    std::vector<std::unique_ptr<Exchange>> exchanges_;
    std::vector<std::deque<std::vector<std::uint8_t>>> inbox_;
    std::size_t bytes_ = 0;
};

TEST(BoundedExchange, TwoBallsThatMeetAcrossWorkersKeepTheirMomentumToRounding) {
    for (const int first : {0, 1}) {
        WorldDefinition d = world_test::weightless();
        for (int i = 0; i < 2; ++i) {
            WorldBody ball = world_test::ball({i * 3.0, 0.02 * i, 0}, Fidelity::modal);
            ball.velocity = {i ? -2.0 : 3.0, 0, 0};
            ball.restitution = 0.5;
            d.bodies.push_back(ball);
        }
        Crew crew(d, 2, 2, 120, {first, 1 - first});
        World alone(d);
        world_test::run(alone, 120);
        const Eigen::Vector3d before = crew.momentum();
        crew.run_in_turn();
        EXPECT_EQ(crew[0].steps_done(), 120u);
        EXPECT_EQ(crew[1].steps_done(), 120u);
        EXPECT_LT((crew.momentum() - before).norm(), 1e-10 * before.norm()) << first;
        for (int b = 0; b < 2; ++b)
            std::printf("%d: %g %g  alone %g %g\n", b, crew.state(b).velocity.x(), crew.state(b).position.x(),
                        alone.state(b).velocity.x(), alone.state(b).position.x());
    }
}

TEST(BoundedExchange, AStackAcrossWorkersStandsAsHighAsInOneProcess) {
    for (const int bound : {0, 1, 4, 8}) {
        WorldDefinition d = world_test::on_floor();
        std::vector<int> owner;
        for (int i = 0; i < 5; ++i) {
            d.bodies.push_back(world_test::box({0, 0.5 + 1.0 * i, 0}, {0.5, 0.5, 0.5}));
            owner.push_back(i % 2);
        }
        World alone(d);
        world_test::run(alone, 600);
        Crew crew(d, 2, bound, 600, owner);
        double highest_speed = 0;
        for (bool any = true; any;) {
            any = false;
            for (std::size_t w = 0; w < 2; ++w) {
                crew.deliver(w);
                for (int k = 0; k <= (w ? 0 : bound); ++k) any = crew.step(w) || any;
            }
            if (crew[0].steps_done() > 400)
                for (int b = 0; b < 5; ++b)
                    highest_speed = std::max(highest_speed, crew.state(b).velocity.norm());
        }
        std::printf("bound %d: fastest after 400 %g m/s\n", bound, highest_speed);
        for (int b = 0; b < 5; ++b)
            std::printf("  %g (%g) m   v %g\n", crew.state(b).position.y(), alone.state(b).position.y(),
                        crew.state(b).velocity.norm());
    }
}

}  // namespace
}  // namespace sim
