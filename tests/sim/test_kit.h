#pragma once
#include <cmath>
#include <random>
#include <vector>

#include "sim/simulation.h"

namespace sim_test {

inline sim::BodyDefinition drum(const Eigen::Vector3d& at = Eigen::Vector3d::Zero()) {
    sim::BodyDefinition body;
    body.name = "drum";
    body.shape = {{0.18, 0.1, 0.18}, 0.1, 1};
    body.world_from_body.translation() = at;
    body.zones = {{"head", 0, 0.9, 0.5, 1.5}, {"rim", 0.9, 1.1, 0.5, 1.5}};
    return body;
}

inline sim::BodyDefinition bell(const Eigen::Vector3d& at) {
    sim::BodyDefinition body;
    body.name = "bell";
    body.shape = {{0.08, 0.1, 0.08}, 1, 1};
    body.material = {1e9, 0.3, 900};
    body.stand = {true, Eigen::Vector3d(0, 0.15, 0), Eigen::Vector3d::UnitX(), 1.2, 0.1};
    body.world_from_body =
        Eigen::Translation3d(at) * Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized());
    body.zones = {{"all", 0, 2, -2, 2}};
    return body;
}

inline sim::BodyDefinition string_body(const Eigen::Vector3d& at) {
    sim::BodyDefinition body;
    body.name = "string";
    body.shape = {{0.3, 0.0025, 0.0025}, 0.1, 1};
    body.world_from_body.translation() = at;
    body.zones = {{"all", 0, 2, -2, 2}};
    return body;
}

/// Ten bodies, a third of a metre apart.
inline std::vector<sim::BodyDefinition> kit() {
    std::vector<sim::BodyDefinition> bodies;
    for (int i = 0; i < 10; ++i) {
        const Eigen::Vector3d at(0.4 * (i % 5) - 0.8, 0.8 + 0.05 * (i % 3), i < 5 ? 0 : 0.45);
        bodies.push_back(i % 5 == 3 ? bell(at) : i % 5 == 4 ? string_body(at) : drum(at));
    }
    return bodies;
}

/// A path of 8 nodes over 1/15 s through `target` at its middle with `velocity` and `acceleration`.
inline sim::TipPath path_through(const Eigen::Vector3d& target, const Eigen::Vector3d& velocity,
                                 const Eigen::Vector3d& acceleration, double t0) {
    sim::TipPath path;
    for (int k = 0; k < 8; ++k) {
        const double h = k / 15.0 / 7, s = h - 1 / 30.0;
        path.nodes.push_back(
            {t0 + h, target + s * velocity + 0.5 * s * s * acceleration, velocity + s * acceleration});
    }
    return path;
}

/// A reproducible run of strokes: each step sweeps two paths; contacts found are felt at once, folded later,
/// drawn meanwhile.
class Scenario {
public:
    explicit Scenario(unsigned seed) : rng_(seed), bodies_(kit()) {}

    [[nodiscard]] const std::vector<sim::BodyDefinition>& bodies() const { return bodies_; }

    [[nodiscard]] sim::StepRequest next() {
        sim::StepRequest request;
        request.t_s = t_ += 1.0 / 60;
        for (const sim::Impulse& impulse : known_) {
            (impulse.t_s <= t_ - 0.02 ? request.folded : request.confirmed).push_back(impulse);
        }
        std::erase_if(known_, [this](const sim::Impulse& impulse) { return impulse.t_s <= t_ - 0.02; });
        for (std::uint32_t stick = 0; stick < 2; ++stick) {
            const auto& body = bodies_[rng_() % bodies_.size()];
            const Eigen::Vector3d target = body.world_from_body.translation() +
                                           Eigen::Vector3d(unit() * 0.1, unit() * 0.15, unit() * 0.1);
            request.paths.push_back(path_through(target,
                                                 Eigen::Vector3d(2 * unit(), -5 + 3 * unit(), 2 * unit()),
                                                 Eigen::Vector3d(0, 200 * unit(), 0), t_));
            request.paths.back().stick = stick;
        }
        sim::PictureRequest picture{t_ + 1.0 / 30, {}};
        for (const sim::Impulse& impulse : request.confirmed)
            picture.provisional.push_back({impulse, 0.5 + 0.5 * unit()});
        request.pictures = {picture, {t_ + 0.01, {}}};
        return request;
    }
    void learn(const sim::StepReply& reply) {
        for (const sim::Contact& c : reply.contacts) {
            if (!c.starts_inside && c.speed_mps > 0.2)
                known_.push_back({c.body, c.t_s, c.point_body, c.impulse_body});
        }
    }

private:
    double unit() { return 2 * (rng_() / 4294967295.0) - 1; }

    std::mt19937 rng_;
    std::vector<sim::BodyDefinition> bodies_;
    std::vector<sim::Impulse> known_;
    double t_ = 0;
};

}  // namespace sim_test
