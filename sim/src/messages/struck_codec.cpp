#include "messages/struck_codec.h"

#include <cmath>

#include "struck/request_check.h"

namespace sim {
namespace {

constexpr std::uint32_t kLongestStruckName = 1024, kMostStruckBodies = 1u << 20;
constexpr std::size_t kSmallestAssignment = 400, kStruckRecordBytes = 120;
constexpr std::size_t kImpulseBytes = 60, kNodeBytes = 56, kStateBytes = 112, kContactBytes = 133,
                      kZoneBytes = 36;

void write(ByteWriter& out, const ModalState& state) {
    out.matrix(state.q);
    out.matrix(state.q_dot);
    out.number(state.swing);
    out.number(state.swing_dot);
}

ModalState read_state(ByteReader& in) {
    ModalState state;
    in.matrix(state.q);
    in.matrix(state.q_dot);
    state.swing = in.number<double>();
    state.swing_dot = in.number<double>();
    if (!state.q.allFinite() || !state.q_dot.allFinite() || !std::isfinite(state.swing) ||
        !std::isfinite(state.swing_dot)) {
        throw DecodeError("a state that is not finite");
    }
    return state;
}

void write(ByteWriter& out, const Impulse& impulse) {
    out.number(impulse.body);
    out.number(impulse.t_s);
    out.matrix(impulse.point_body);
    out.matrix(impulse.impulse_body);
}

Impulse read_impulse(ByteReader& in) {
    Impulse impulse;
    impulse.body = in.number<std::uint32_t>();
    impulse.t_s = in.number<double>();
    in.matrix(impulse.point_body);
    in.matrix(impulse.impulse_body);
    return impulse;
}

void write(ByteWriter& out, const std::vector<Impulse>& impulses) {
    out.count(impulses.size());
    for (const Impulse& impulse : impulses) write(out, impulse);
}

std::vector<Impulse> read_impulses(ByteReader& in) {
    std::vector<Impulse> impulses(in.count(kImpulseBytes));
    for (Impulse& impulse : impulses) impulse = read_impulse(in);
    return impulses;
}

TipPath read_path(ByteReader& in) {
    TipPath path;
    path.stick = in.number<std::uint32_t>();
    path.tip_radius_m = in.number<double>();
    path.nodes.resize(in.count(kNodeBytes));
    for (PathNode& node : path.nodes) {
        node.t_s = in.number<double>();
        in.matrix(node.position);
        in.matrix(node.velocity);
    }
    return path;
}

PictureRequest read_picture(ByteReader& in) {
    PictureRequest picture;
    picture.t_s = in.number<double>();
    picture.provisional.resize(in.count(kImpulseBytes + 8));
    for (WeightedImpulse& w : picture.provisional) {
        w.impulse = read_impulse(in);
        w.weight = in.number<double>();
    }
    return picture;
}

void write(ByteWriter& out, const BodyOutcome::PathContact& found) {
    const Contact& c = found.contact;
    out.number(found.path);
    out.number(c.stick);
    out.number(c.t_s);
    out.number<std::uint8_t>(c.starts_inside);
    out.number(c.depth_m);
    out.number(c.speed_mps);
    out.number(c.zone);
    for (const Eigen::Vector3d& v : {c.point_world, c.normal_world, c.point_body, c.impulse_body})
        out.matrix(v);
}

BodyOutcome::PathContact read_contact(ByteReader& in, std::uint32_t body) {
    BodyOutcome::PathContact found;
    Contact& c = found.contact;
    found.path = in.number<std::uint32_t>();
    c.stick = in.number<std::uint32_t>();
    c.body = body;
    c.t_s = in.number<double>();
    c.starts_inside = in.flag();
    c.depth_m = in.number<double>();
    c.speed_mps = in.number<double>();
    c.zone = in.number<std::int32_t>();
    for (Eigen::Vector3d* v : {&c.point_world, &c.normal_world, &c.point_body, &c.impulse_body}) {
        in.matrix(*v);
        if (!v->allFinite()) throw DecodeError("a contact that is not finite");
    }
    if (!std::isfinite(c.t_s) || !std::isfinite(c.depth_m) || !std::isfinite(c.speed_mps) || c.zone < -1) {
        throw DecodeError("a contact out of range");
    }
    return found;
}

void write(ByteWriter& out, const BodyDefinition& b) {
    out.text(b.name);
    out.matrix(b.shape.semi_axes);
    for (const double x :
         {b.shape.e1, b.shape.e2, b.material.young_pa, b.material.poisson, b.material.density_kg_m3})
        out.number(x);
    out.number<std::uint8_t>(b.visual.enabled);
    for (const double x : {b.visual.frequency_hz, b.visual.displacement, b.visual.decay_s}) out.number(x);
    out.number<std::uint8_t>(b.stand.hinged);
    out.matrix(b.stand.pivot_body);
    out.matrix(b.stand.axis_body);
    out.number(b.stand.frequency_hz);
    out.number(b.stand.damping_ratio);
    out.matrix(b.world_from_body.linear());
    out.matrix(b.world_from_body.translation());
    out.number(b.stick_mass_kg);
    out.number(b.restitution);
    out.count(b.zones.size());
    for (const Zone& zone : b.zones) {
        out.text(zone.name);
        for (const double x : {zone.min_radius, zone.max_radius, zone.min_height, zone.max_height})
            out.number(x);
    }
}

BodyDefinition read_definition(ByteReader& in) {
    BodyDefinition b;
    b.name = in.text(kLongestStruckName);
    in.matrix(b.shape.semi_axes);
    for (double* x :
         {&b.shape.e1, &b.shape.e2, &b.material.young_pa, &b.material.poisson, &b.material.density_kg_m3}) {
        *x = in.number<double>();
    }
    b.visual.enabled = in.flag();
    for (double* x : {&b.visual.frequency_hz, &b.visual.displacement, &b.visual.decay_s})
        *x = in.number<double>();
    b.stand.hinged = in.flag();
    in.matrix(b.stand.pivot_body);
    in.matrix(b.stand.axis_body);
    b.stand.frequency_hz = in.number<double>();
    b.stand.damping_ratio = in.number<double>();
    in.matrix(b.world_from_body.linear());
    in.matrix(b.world_from_body.translation());
    b.stick_mass_kg = in.number<double>();
    b.restitution = in.number<double>();
    b.zones.resize(in.count(kZoneBytes));
    for (Zone& zone : b.zones) {
        zone.name = in.text(kLongestStruckName);
        for (double* x : {&zone.min_radius, &zone.max_radius, &zone.min_height, &zone.max_height})
            *x = in.number<double>();
    }
    return b;
}

void write(ByteWriter& out, const StepRequest& request) {
    out.number(request.t_s);
    out.number(static_cast<std::uint8_t>(request.anew));
    write(out, request.folded);
    write(out, request.confirmed);
    out.count(request.paths.size());
    for (const TipPath& path : request.paths) {
        out.number(path.stick);
        out.number(path.tip_radius_m);
        out.count(path.nodes.size());
        for (const PathNode& node : path.nodes) {
            out.number(node.t_s);
            out.matrix(node.position);
            out.matrix(node.velocity);
        }
    }
    out.count(request.pictures.size());
    for (const PictureRequest& picture : request.pictures) {
        out.number(picture.t_s);
        out.count(picture.provisional.size());
        for (const WeightedImpulse& w : picture.provisional) {
            write(out, w.impulse);
            out.number(w.weight);
        }
    }
}

StepRequest read_request(ByteReader& in) {
    StepRequest request;
    request.t_s = in.number<double>();
    request.anew = in.flag();
    request.folded = read_impulses(in);
    request.confirmed = read_impulses(in);
    request.paths.resize(in.count(16));
    for (TipPath& path : request.paths) path = read_path(in);
    request.pictures.resize(in.count(12));
    for (PictureRequest& picture : request.pictures) picture = read_picture(in);
    return request;
}

void write_record(ByteWriter& out, std::uint32_t body, std::uint32_t epoch, const ModalState& state) {
    out.number(body);
    out.number(epoch);
    write(out, state);
}

ModalState read_record(ByteReader& in, std::uint32_t& body, std::uint32_t epoch) {
    body = in.number<std::uint32_t>();
    const std::uint32_t found = in.number<std::uint32_t>();
    if (found != epoch)
        throw DecodeError("a record of epoch " + std::to_string(found) + " in a message of " +
                          std::to_string(epoch));
    return read_state(in);
}

void write(ByteWriter& out, const BodyOutcome& outcome, std::uint32_t epoch) {
    write_record(out, outcome.body, epoch, outcome.state);
    out.count(outcome.pictures.size());
    for (const ModalState& state : outcome.pictures) write(out, state);
    out.count(outcome.clearance_m.size());
    for (const double clearance : outcome.clearance_m) out.number(clearance);
    out.count(outcome.contacts.size());
    for (const BodyOutcome::PathContact& found : outcome.contacts) write(out, found);
}

BodyOutcome read_outcome(ByteReader& in, std::uint32_t epoch) {
    BodyOutcome outcome;
    outcome.state = read_record(in, outcome.body, epoch);
    outcome.pictures.resize(in.count(kStateBytes));
    for (ModalState& state : outcome.pictures) state = read_state(in);
    outcome.clearance_m.resize(in.count(8));
    for (double& clearance : outcome.clearance_m) {
        clearance = in.number<double>();
        if (!std::isfinite(clearance)) throw DecodeError("a clearance that is not finite");
    }
    outcome.contacts.resize(in.count(kContactBytes));
    for (BodyOutcome::PathContact& found : outcome.contacts) {
        found = read_contact(in, outcome.body);
        if (found.path >= outcome.clearance_m.size())
            throw DecodeError("a contact on a path that was not swept");
    }
    return outcome;
}

}  // namespace

void write(ByteWriter& out, const StruckAssign& m) {
    out.number(m.epoch);
    out.count(m.bodies.size());
    for (const StruckAssignment& a : m.bodies) {
        write(out, a.definition);
        write_record(out, a.body, m.epoch, a.record.state);
        out.number<std::uint8_t>(a.record.stepped);
        out.number(a.record.t_s);
    }
}

void write(ByteWriter& out, const StruckStep& m) {
    out.number(m.epoch);
    out.number(m.step);
    out.count(m.bodies.size());
    for (const std::uint32_t body : m.bodies) out.number(body);
    write(out, m.request);
}

void write(ByteWriter& out, const StruckAnswer& m) {
    out.number(m.epoch);
    out.number(m.step);
    out.count(m.outcomes.size());
    for (const BodyOutcome& outcome : m.outcomes) write(out, outcome, m.epoch);
}

StruckAssign read_struck_assign(ByteReader& in) {
    StruckAssign m;
    m.epoch = in.number<std::uint32_t>();
    m.bodies.resize(in.count(kSmallestAssignment));
    for (StruckAssignment& a : m.bodies) {
        a.definition = read_definition(in);
        check_body(a.definition);
        a.record.state = read_record(in, a.body, m.epoch);
        a.record.stepped = in.flag();
        a.record.t_s = in.number<double>();
        if (a.body >= kMostStruckBodies || !(std::abs(a.record.t_s) <= kTimeLimit_s))
            throw DecodeError("a record out of range");
    }
    return m;
}

StruckStep read_struck_step(ByteReader& in) {
    StruckStep m;
    m.epoch = in.number<std::uint32_t>();
    m.step = in.number<std::uint64_t>();
    m.bodies.resize(in.count(4));
    for (std::uint32_t& body : m.bodies) body = in.number<std::uint32_t>();
    m.request = read_request(in);
    check_request(m.request, kMostStruckBodies);
    return m;
}

StruckAnswer read_struck_answer(ByteReader& in) {
    StruckAnswer m;
    m.epoch = in.number<std::uint32_t>();
    m.step = in.number<std::uint64_t>();
    m.outcomes.resize(in.count(kStruckRecordBytes));
    for (BodyOutcome& outcome : m.outcomes) outcome = read_outcome(in, m.epoch);
    return m;
}

}  // namespace sim
