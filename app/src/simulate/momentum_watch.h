#pragma once
#include <sim/distributed_world.h>

#include <optional>

namespace app {

/// Momentum that came from nowhere.
struct MomentumDrift {
    double linear = 0;              ///< largest seen; at the end where more than gravity acted [kg m/s]
    std::optional<double> angular;  ///< largest seen [kg m^2/s]; known where nothing at all acted
    double scale = 0;               ///< largest sum of |m v| over the bodies [kg m/s]
};

/// Compares the total momentum with the impulse that came from outside: with gravity's while nothing else
/// acts, else at the end with what the world counted (World::outside_impulse).
class MomentumWatch {
public:
    MomentumWatch(const sim::WorldScene& scene, const sim::World& world);
    void look(const sim::World& world);  ///< now and then, and at the end
    /// `outside`: the impulse since the start, if it is known. None: unknown.
    [[nodiscard]] std::optional<MomentumDrift> drift(const std::optional<Eigen::Vector3d>& outside) const;

private:
    [[nodiscard]] Eigen::Vector3d brought(const sim::World& world) const;

    const sim::WorldScene& scene_;
    bool closed_ = false;  ///< nothing acts from outside but gravity
    Eigen::Vector3d weight_ = Eigen::Vector3d::Zero(), momentum_, angular_momentum_;
    Eigen::Vector3d gained_ = Eigen::Vector3d::Zero();  ///< since the start, but by bodies that came later
    double linear_ = 0, angular_ = 0, scale_ = 0;
};

}  // namespace app
