#include "struck/request_check.h"

#include <cmath>
#include <sstream>

#include "sim/errors.h"
#include "struck/body_model.h"

namespace sim {
namespace {

[[noreturn]] void reject(const std::string& where, double found, const char* expected) {
    std::ostringstream number;
    number.precision(17);
    number << found;
    throw InputError(where, number.str(), expected);
}

// Compares so that NaN fails.
void in_range(const std::string& where, double value, double low, double high, const char* expected) {
    if (!(value >= low && value <= high)) reject(where, value, expected);
}

void check_vector(const std::string& where, const Eigen::Vector3d& v, double limit, const char* expected) {
    for (int i = 0; i < 3; ++i) in_range(where, v[i], -limit, limit, expected);
}

void check_stand(const std::string& name, const Stand& stand) {
    check_vector(name + "stand.pivot_body", stand.pivot_body, 1000, "a point within 1000 m");
    check_vector(name + "stand.axis_body", stand.axis_body, 1e6, "a direction");
    if (!stand.hinged) return;
    in_range(name + "stand.axis_body's length", stand.axis_body.norm(), 1e-6, 2e6, "a direction");
    in_range(name + "stand.frequency_hz", stand.frequency_hz, 1e-3, 1e3, "0.001 to 1000");
    in_range(name + "stand.damping_ratio", stand.damping_ratio, 0, 1e3, "0 to 1000");
}

void check_impulse(const Impulse& impulse, std::size_t bodies) {
    if (impulse.body >= bodies) reject("impulse.body", impulse.body, "the index of a body");
    in_range("impulse.t_s", impulse.t_s, -kTimeLimit_s, kTimeLimit_s, "a time within 1e8 s");
    check_vector("impulse.point_body", impulse.point_body, 1e3, "a point within 1000 m");
    check_vector("impulse.impulse_body", impulse.impulse_body, 1e6, "at most 1e6 N s");
}

void check_path(const TipPath& path) {
    in_range("path.tip_radius_m", path.tip_radius_m, 0, 1, "0 to 1");
    if (path.nodes.size() < 2) reject("path's number of nodes", double(path.nodes.size()), "at least 2");
    double last = -2 * kTimeLimit_s;
    for (const PathNode& node : path.nodes) {
        in_range("path node's t_s", node.t_s, -kTimeLimit_s, kTimeLimit_s, "a time within 1e8 s");
        if (!(node.t_s > last)) reject("path node's t_s", node.t_s, "times that increase strictly");
        check_vector("path node's position", node.position, 1e6, "a point within 1e6 m");
        check_vector("path node's velocity", node.velocity, 1e6, "at most 1e6 m/s");
        last = node.t_s;
    }
}

}  // namespace

void check_body(const BodyDefinition& body) {
    const std::string name = "body '" + body.name + "': ";
    for (int i = 0; i < 3; ++i)
        in_range(name + "semi_axes", body.shape.semi_axes[i], 1e-4, 100, "0.0001 to 100 m");
    in_range(name + "e1", body.shape.e1, -1e3, 1e3, "a finite exponent");
    in_range(name + "e2", body.shape.e2, -1e3, 1e3, "a finite exponent");
    in_range(name + "young_pa", body.material.young_pa, 1e-3, 1e15, "0.001 to 1e15");
    in_range(name + "poisson", body.material.poisson, -0.999, 0.4999, "-0.999 to 0.4999");
    in_range(name + "density_kg_m3", body.material.density_kg_m3, 1e-3, 1e6, "0.001 to 1e6");
    in_range(name + "visual.frequency_hz", body.visual.frequency_hz, 1e-3, 1e4, "0.001 to 10000");
    in_range(name + "visual.displacement", body.visual.displacement, 0, 1, "0 to 1");
    in_range(name + "visual.decay_s", body.visual.decay_s, 1e-3, 1e4, "0.001 to 10000");
    in_range(name + "stick_mass_kg", body.stick_mass_kg, 1e-6, 1e3, "0.000001 to 1000");
    in_range(name + "restitution", body.restitution, 0, 1, "0 to 1");
    check_stand(name, body.stand);
    const Eigen::Matrix3d rotation = body.world_from_body.linear();
    in_range(name + "world_from_body's rotation: error",
             (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-6,
             "an orthonormal matrix");
    in_range(name + "world_from_body's rotation: determinant", rotation.determinant(), 0.5, 1.5, "1");
    check_vector(name + "world_from_body's translation", body.world_from_body.translation(), 1e6,
                 "a point within 1e6 m");
    for (const Zone& zone : body.zones) {
        for (const double bound : {zone.min_radius, zone.max_radius, zone.min_height, zone.max_height}) {
            in_range(name + "zone '" + zone.name + "'", bound, -1e6, 1e6, "finite bounds");
        }
    }
}

void check_request(const StepRequest& request, std::size_t bodies) {
    in_range("request.t_s", request.t_s, -kTimeLimit_s, kTimeLimit_s, "a time within 1e8 s");
    for (const Impulse& impulse : request.folded) {
        check_impulse(impulse, bodies);
        if (impulse.t_s > request.t_s)
            reject("folded impulse's t_s", impulse.t_s, "a time not after the step's");
    }
    for (const Impulse& impulse : request.confirmed) check_impulse(impulse, bodies);
    for (const TipPath& path : request.paths) check_path(path);
    for (const PictureRequest& picture : request.pictures) {
        in_range("picture.t_s", picture.t_s, request.t_s, kTimeLimit_s, "a time not before the step's");
        for (const WeightedImpulse& w : picture.provisional) {
            check_impulse(w.impulse, bodies);
            in_range("provisional impulse's weight", w.weight, -1e6, 1e6, "a finite weight");
        }
    }
}

}  // namespace sim
