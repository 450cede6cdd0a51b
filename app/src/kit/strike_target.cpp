#include "kit/strike_target.h"

#include <sim/simulation.h>

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
    Eigen::Vector3d inside = body.world_from_body * inside_body;
    Eigen::Vector3d outside =
        inside + body.world_from_body.linear() * outwards_body * (2 * half.norm() + tip_radius_m + 0.1);
    // Halves points, not a parameter as entry_between() does: the bundled traces keep their last digits.
    constexpr int kHalvings = 60;
    for (int i = 0; i < kHalvings; ++i) {
        const Eigen::Vector3d middle = 0.5 * (inside + outside);
        (sim::rest_distance(body, middle, tip_radius_m).distance > 0 ? outside : inside) = middle;
    }
    return {outside, sim::rest_distance(body, outside, tip_radius_m).normal.normalized()};
}

}  // namespace app
