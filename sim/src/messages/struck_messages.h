#pragma once
#include <cstdint>
#include <vector>

#include "messages/body_fields.h"
#include "struck/request_check.h"
#include "struck/stepped_body.h"

namespace sim {

// Messages between a play and the workers that simulate its struck bodies; their header is that of
// worker_messages.h.

constexpr std::uint32_t kLongestStruckName = 1024, kMostStruckBodies = 1u << 20;

void fields(auto& archive, Is<ModalState> auto& s) {
    archive("q q_dot swing swing_dot", finite(s.q), finite(s.q_dot), finite(s.swing), finite(s.swing_dot));
}
void fields(auto& archive, Is<Impulse> auto& i) {
    archive("body t_s point_body impulse_body", i.body, i.t_s, i.point_body, i.impulse_body);
}
void fields(auto& archive, Is<PathNode> auto& n) {
    archive("t_s position velocity", n.t_s, n.position, n.velocity);
}
void fields(auto& archive, Is<TipPath> auto& p) {
    archive("stick tip_radius_m nodes", p.stick, p.tip_radius_m, p.nodes);
}
void fields(auto& archive, Is<WeightedImpulse> auto& w) {
    archive("impulse weight", w.impulse, w.weight);
}
void fields(auto& archive, Is<PictureRequest> auto& p) {
    archive("t_s provisional", p.t_s, p.provisional);
}
template <typename Archive>
void fields(Archive& archive, Is<StepRequest> auto& r) {
    archive("t_s anew folded confirmed paths pictures", r.t_s, r.anew, r.folded, r.confirmed, r.paths,
            r.pictures);
    if constexpr (Archive::kReads) check_request(r, kMostStruckBodies);
}

void fields(auto& archive, Is<Zone> auto& z) {
    archive("name min_radius max_radius min_height max_height", Text{z.name, kLongestStruckName},
            z.min_radius, z.max_radius, z.min_height, z.max_height);
}
void fields(auto& archive, Is<VisualModes> auto& v) {
    archive("enabled frequency_hz displacement decay_s", v.enabled, v.frequency_hz, v.displacement,
            v.decay_s);
}
void fields(auto& archive, Is<Stand> auto& s) {
    archive("hinged pivot_body axis_body frequency_hz damping_ratio", s.hinged, s.pivot_body, s.axis_body,
            s.frequency_hz, s.damping_ratio);
}
template <typename Archive>
void fields(Archive& archive, Is<BodyDefinition> auto& b) {
    archive("name shape material visual stand", Text{b.name, kLongestStruckName}, b.shape, b.material,
            b.visual, b.stand);
    archive("world_from_body stick_mass_kg restitution zones", b.world_from_body, b.stick_mass_kg,
            b.restitution, b.zones);
    if constexpr (Archive::kReads) check_body(b);
}

/// A body's state in a message of ownership `epoch`.
void state_fields(auto& archive, auto& body, std::uint32_t epoch, auto& state) {
    std::uint32_t found = epoch;
    archive("body epoch state", body, found, state);
    archive.check(found == epoch, "a record of another epoch than its message");
}

struct StruckAssignment {
    std::uint32_t body;
    BodyDefinition definition;
    BodyRecord record;
};
struct StruckAssign {
    static constexpr const char* kRoute = "application to one worker";
    std::uint32_t epoch = 0;
    std::vector<StruckAssignment> bodies;  ///< none: the worker has a place
};
void fields(auto& archive, Is<StruckAssign> auto& m) {
    const auto assignment = [&](auto& each, auto& a) {
        each("definition", a.definition);
        state_fields(each, a.body, m.epoch, a.record.state);
        each("stepped t_s", a.record.stepped, Within{a.record.t_s, -kTimeLimit_s, kTimeLimit_s});
        each.check(a.body < kMostStruckBodies, "a body out of range");
    };
    archive("epoch bodies", m.epoch, Each{m.bodies, assignment});
}

struct StruckStep {
    static constexpr const char* kRoute = "application to one worker";
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<std::uint32_t> bodies;
    StepRequest request;
};
void fields(auto& archive, Is<StruckStep> auto& m) {
    archive("epoch step bodies request", m.epoch, m.step, m.bodies, m.request);
}

void fields(auto& archive, Is<BodyOutcome::PathContact> auto& found) {
    auto& c = found.contact;
    archive("path stick t_s starts_inside depth_m speed_mps", found.path, c.stick, finite(c.t_s),
            c.starts_inside, finite(c.depth_m), finite(c.speed_mps));
    archive("zone", Within{c.zone, -1, std::numeric_limits<std::int32_t>::max()});
    archive("point_world normal_world point_body impulse_body", finite(c.point_world), finite(c.normal_world),
            finite(c.point_body), finite(c.impulse_body));
}

struct StruckAnswer {
    static constexpr const char* kRoute = "worker to application";
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<BodyOutcome> outcomes;
};
template <typename Archive>
void fields(Archive& archive, Is<StruckAnswer> auto& m) {
    const auto outcome = [&](auto& each, auto& o) {
        state_fields(each, o.body, m.epoch, o.state);
        each("pictures clearance_m contacts", o.pictures, finite(o.clearance_m), o.contacts);
        if constexpr (Archive::kReads) {
            for (auto& found : o.contacts) {
                each.check(found.path < o.clearance_m.size(), "a contact on a path that was not swept");
                found.contact.body = o.body;
            }
        }
    };
    archive("epoch step outcomes", m.epoch, m.step, Each{m.outcomes, outcome});
}

}  // namespace sim
