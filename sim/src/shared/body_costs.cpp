#include "shared/body_costs.h"

namespace sim {

void BodyCosts::add(const SharedWorld& world, std::span<const int> bodies) {
    for (const int body : bodies) {
        double& cost = cost_[static_cast<std::size_t>(body)];
        cost = cost < 0 ? world.work(body) : cost + (world.work(body) - cost) / kSmoothing;
    }
}

}  // namespace sim
