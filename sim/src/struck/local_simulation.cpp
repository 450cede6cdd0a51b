#include "sim/errors.h"
#include "sim/simulation.h"
#include "struck/request_check.h"
#include "struck/stepped_body.h"

namespace sim {
namespace {

class LocalSimulation final : public Simulation {
public:
    explicit LocalSimulation(const std::vector<BodyDefinition>& definitions) : outcomes_(definitions.size()) {
        bodies_.reserve(definitions.size());
        for (const BodyDefinition& definition : definitions) {
            bodies_.emplace_back(static_cast<std::uint32_t>(bodies_.size()), definition);
        }
    }

    StepReply step(const StepRequest& request) override {
        check_request(request, bodies_.size());
        if (stepped_ && !request.anew && request.t_s < last_t_s_)
            throw InputError("request.t_s is before the last step's");
        for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].step(request, outcomes_[i]);
        stepped_ = true;
        last_t_s_ = request.t_s;
        return merge(outcomes_, request);
    }

    WorkerReport report() const override { return {}; }

private:
    std::vector<SteppedBody> bodies_;
    std::vector<BodyOutcome> outcomes_;
    bool stepped_ = false;
    double last_t_s_ = 0;
};

}  // namespace

// By value as its public contract says: a caller hands its bodies over.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
std::unique_ptr<Simulation> make_local_simulation(std::vector<BodyDefinition> bodies) {
    return std::make_unique<LocalSimulation>(bodies);
}

SurfacePoint rest_distance(const BodyDefinition& body, const Eigen::Vector3d& point_world, double radius_m) {
    const ClosestPoint foot =
        closest_point(Gauge(body.shape), {}, body.world_from_body.inverse() * point_world);
    return {foot.distance - radius_m, body.world_from_body.linear() * foot.normal};
}

int rest_zone(const BodyDefinition& body, const Eigen::Vector3d& point_world) {
    const ClosestPoint foot =
        closest_point(Gauge(body.shape), {}, body.world_from_body.inverse() * point_world);
    return zone_at(body, foot.rest_point);
}

}  // namespace sim
