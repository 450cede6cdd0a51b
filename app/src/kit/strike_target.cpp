#include "kit/strike_target.h"

#include <sim/simulation.h>

#include "kit/surface_entry.h"

namespace app {
namespace {

/// An upright bell is struck on its side; a bar lies flat and is struck from above.
bool struck_on_side(const Instrument& instrument) {
    const Eigen::Vector3d& half = instrument.body.shape.semi_axes;
    return instrument.kind == "bell" && half.y() > 0.5 * half.x();
}

}  // namespace

StrikeTarget strike_target(const Instrument& instrument, double tip_radius_m, double across, double along) {
    const sim::BodyDefinition& body = instrument.body;
    const Eigen::Vector3d& half = body.shape.semi_axes;
    const bool side = struck_on_side(instrument);
    const Eigen::Vector3d inside_body = side ? Eigen::Vector3d(across * half.x(), along * half.y(), 0)
                                             : Eigen::Vector3d(across * half.x(), 0, -along * half.z());
    const Eigen::Vector3d outwards_body =
        side ? Eigen::Vector3d(0, 0.4, 1).normalized() : Eigen::Vector3d::UnitY();
    const Eigen::Vector3d inside = body.world_from_body * inside_body;
    const Eigen::Vector3d inwards =
        body.world_from_body.linear() * outwards_body * -(2 * half.norm() + tip_radius_m + 0.1);
    const auto distance = [&](double share) {
        return sim::rest_distance(body, inside - (1 - share) * inwards, tip_radius_m).distance;
    };
    const Eigen::Vector3d point = inside - (1 - entry_between(0, 1, 0, distance)) * inwards;
    return {point, sim::rest_distance(body, point, tip_radius_m).normal.normalized()};
}

}  // namespace app
