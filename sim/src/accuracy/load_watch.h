#pragma once
#include <array>
#include <vector>

#include "modes/contact_compliance.h"
#include "sim/distributed_world.h"

namespace sim {

/// The largest load on one place of a body, and when it acted.
struct PlaceLoad {
    ContactLoad load;
    double speed_s = 0, force_s = 0;
};
using BodyLoads = std::array<PlaceLoad, kContactPlaces>;

/// Watches a run for what presses on each body: impacts by the change of its velocity within a step in which
/// it touches something, beyond gravity's, and forces that last for two steps by its contacts' impulses of the
/// last substep, together for what touches it.
class LoadWatch {
public:
    /// Of all bodies; must stay.
    explicit LoadWatch(const std::vector<const ContactCompliance*>& kinds) : kinds_(&kinds) {}
    void at(const World& world);
    [[nodiscard]] const std::vector<BodyLoads>& loads() const noexcept { return loads_; }

private:
    void press(const World& world, int body, const Eigen::Vector3d& arm, double force);
    void hit(const World& world, int body);

    const std::vector<const ContactCompliance*>* kinds_;
    std::vector<BodyLoads> loads_;
    std::vector<Eigen::Vector3d> velocities_;
    using Forces = std::vector<std::array<double, kContactPlaces>>;
    Forces before_, now_;  // [N]
    struct Touch {
        bool any = false;
        double force = 0;                              // of the hardest contact [N]
        Eigen::Vector3d at = Eigen::Vector3d::Zero();  // its middle, body frame
    };
    std::vector<Touch> touches_;  // of each body in this step
};

/// The larger of each.
void join_loads(const std::vector<BodyLoads>& others, std::vector<BodyLoads>& loads);

}  // namespace sim
