#include <algorithm>
#include <cmath>
#include <string>

#include "contact/manifold.h"
#include "messages/world_record_codec.h"
#include "run/scene_clock.h"
#include "sim/errors.h"

namespace sim {
namespace {

//   u64 step; lists of record (world_record_codec.h), of contact and of spring; v3 outside impulse
//   f64 elapsed s, cpu s
//   i32 contacts, pairs, islands, asleep; u64 inverse fallbacks, deformations limited, constraints broken, impacts,
//   solved again, held apart
//   list of quarantined {u32 body, u64 step, text}; lists of limited and of broken {u32 number, u64 step}
//
//   contact     10 + 32 n bytes: u32 a, u32 b, u8 (1 emerging),
//               u8 n points of {u32 feature, w3 arm, f32 normal impulse, w3 friction impulse}
//   spring      41 bytes: u32 constraint, flag holds, 3 w3 impulses

constexpr std::size_t kQuarantinedBytes = 16, kFirstBytes = 12, kSmallestContact = 10, kSpringBytes = 41;
constexpr std::uint32_t kLongestReason = 4096;

void write_floats(ByteWriter& out, const Eigen::Vector3f& v) {
    for (int i = 0; i < 3; ++i) out.number(v[i]);
}

float finite_float(ByteReader& in) {
    const auto value = in.number<float>();
    if (!std::isfinite(value)) throw DecodeError("an impulse that is not finite");
    return value;
}

Eigen::Vector3f read_floats(ByteReader& in) {
    Eigen::Vector3f v;
    for (int i = 0; i < 3; ++i) v[i] = finite_float(in);
    return v;
}

void write(ByteWriter& out, const ContactRecord& c) {
    out.number(static_cast<std::uint32_t>(c.a));
    out.number(static_cast<std::uint32_t>(c.b));
    out.number<std::uint8_t>(c.emerging);
    out.number(static_cast<std::uint8_t>(c.count));
    for (int i = 0; i < c.count; ++i) {
        out.number(c.points[i].feature);
        write_floats(out, c.points[i].arm_a);
        out.number(c.points[i].normal_impulse);
        write_floats(out, c.points[i].friction_impulse);
    }
}

ContactRecord read_contact(ByteReader& in) {
    ContactRecord c;
    const auto a = in.number<std::uint32_t>(), b = in.number<std::uint32_t>();
    c.emerging = in.flag();
    c.count = in.number<std::uint8_t>();
    const bool two_bodies = a < b && b < kMostWorldBodies;
    const bool plane = a < kMostWorldBodies && b >= kFirstPlane && b < kFirstPlane + kMostWorldBodies;
    if (!(two_bodies || plane) || c.count > 4) throw DecodeError("a contact out of range");
    c.a = static_cast<int>(a), c.b = static_cast<int>(b);
    for (int i = 0; i < c.count; ++i) {
        c.points[i].feature = in.number<std::uint32_t>();
        c.points[i].arm_a = read_floats(in);
        c.points[i].normal_impulse = finite_float(in);
        c.points[i].friction_impulse = read_floats(in);
    }
    return c;
}

SpringRecord read_spring(ByteReader& in) {
    SpringRecord s;
    const auto constraint = in.number<std::uint32_t>();
    if (constraint >= kMostWorldBodies) throw DecodeError("a constraint out of range");
    s.constraint = static_cast<int>(constraint);
    s.holds = in.flag();
    for (Eigen::Vector3f& impulse : s.impulses) impulse = read_floats(in);
    return s;
}

void write(ByteWriter& out, const std::vector<ContactRecord>& contacts) {
    out.count(contacts.size());
    for (const ContactRecord& c : contacts) write(out, c);
}

void write(ByteWriter& out, const std::vector<SpringRecord>& springs) {
    out.count(springs.size());
    for (const SpringRecord& s : springs) {
        out.number(static_cast<std::uint32_t>(s.constraint));
        out.number<std::uint8_t>(s.holds);
        for (const Eigen::Vector3f& impulse : s.impulses) write_floats(out, impulse);
    }
}

std::vector<ContactRecord> read_contact_records(ByteReader& in) {
    std::vector<ContactRecord> contacts(in.count(kSmallestContact));
    for (ContactRecord& c : contacts) c = read_contact(in);
    return contacts;
}

std::vector<SpringRecord> read_spring_records(ByteReader& in) {
    std::vector<SpringRecord> springs(in.count(kSpringBytes));
    for (SpringRecord& s : springs) s = read_spring(in);
    return springs;
}

void write(ByteWriter& out, const WorldSnapshot& snapshot) {
    out.number(snapshot.step);
    write(out, snapshot.bodies);
    write(out, snapshot.contacts);
    write(out, snapshot.springs);
    out.matrix(snapshot.outside);
}

WorldSnapshot read_snapshot(ByteReader& in) {
    WorldSnapshot snapshot;
    snapshot.step = in.number<std::uint64_t>();
    snapshot.bodies = read_world_records(in);
    snapshot.contacts = read_contact_records(in);
    snapshot.springs = read_spring_records(in);
    in.matrix(snapshot.outside);
    if (!snapshot.outside.allFinite()) throw DecodeError("an impulse that is not finite");
    return snapshot;
}

/// Every number of a result of one process, in order; `result` may be const.
template <typename Result, typename Visit>
void visit_numbers(Result& r, Visit visit) {
    visit(r.elapsed_s), visit(r.cpu_s);
    auto& n = r.counts;
    visit(n.contacts), visit(n.pairs), visit(n.islands), visit(n.asleep);
    visit(n.inverse_fallbacks), visit(n.deformations_limited), visit(n.constraints_broken), visit(n.impacts);
    visit(n.solved_again), visit(n.held_apart);
}

void write(ByteWriter& out, const std::vector<FirstStep>& all) {
    out.count(all.size());
    for (const FirstStep& first : all) {
        out.number(static_cast<std::uint32_t>(first.number));
        out.number(first.step);
    }
}

void check(bool holds, const char* what) {
    if (!holds) throw DecodeError(what);
}

/// A number below `end`, and a step that has been.
FirstStep read_first(ByteReader& in, std::size_t end, std::uint64_t now) {
    const auto number = in.number<std::uint32_t>();
    const auto step = in.number<std::uint64_t>();
    check(number < end && step >= 1 && step <= now, "a mishap of nothing that is there");
    return {static_cast<int>(number), step};
}

void read(ByteReader& in, std::vector<FirstStep>& all, std::size_t end, std::uint64_t now) {
    all.resize(in.count(kFirstBytes));
    for (FirstStep& first : all) first = read_first(in, end, now);
}

void check_contact(const ContactRecord& c, const World& world, std::size_t planes) {
    const int bodies = world.bodies();
    const bool plane = c.b >= kFirstPlane;
    check(c.a < bodies && (plane ? static_cast<std::size_t>(c.b - kFirstPlane) < planes : c.b < bodies),
          "a contact of a body that is not there");
    check(world.definition(c.a).moves() || (!plane && world.definition(c.b).moves()),
          "a contact of what does not move");
}

/// Whether a world of the scene can be there: each body's and constraint's record in its place, contacts of
/// bodies that are there, ascending.
void check_fits(const WorldSnapshot& snapshot, const WorldScene& scene) {
    check(snapshot.step >= 1, "a state before the first step");
    World world(scene.world);
    SceneClock(scene).apply(world, snapshot.step - 1);
    check(snapshot.bodies.size() == static_cast<std::size_t>(world.bodies()), "another number of bodies");
    for (int i = 0; i < world.bodies(); ++i) {
        const WorldRecord& r = snapshot.bodies[static_cast<std::size_t>(i)];
        check(r.body == i && r.state.q.size() == world.state(i).q.size(), "another body");
        check(r.sleep_group >= -1 && r.sleep_group <= i, "a body that sleeps with none");
        check(!is_broken(r.state), "a body that is not finite");
    }
    std::pair<int, int> last(-1, -1);
    for (const ContactRecord& c : snapshot.contacts) {
        check_contact(c, world, scene.world.planes.size());
        check(last < std::pair(c.a, c.b), "contacts that do not ascend");
        last = {c.a, c.b};
    }
    check(snapshot.springs.size() == scene.world.constraints.size(), "another number of constraints");
    for (std::size_t i = 0; i < snapshot.springs.size(); ++i)
        check(snapshot.springs[i].constraint == static_cast<int>(i), "another constraint");
}

void read_result(ByteReader& in, const WorldScene& scene, const WorldSnapshot& now, DistributedResult& r) {
    r.steps = r.counts.steps = now.step;
    visit_numbers(r, [&](auto& number) { number = in.number<std::decay_t<decltype(number)>>(); });
    check(r.elapsed_s >= 0 && r.cpu_s >= 0 && r.elapsed_s < 1e12 && r.cpu_s < 1e12, "a time out of range");
    r.quarantined.resize(in.count(kQuarantinedBytes));
    for (QuarantinedBody& q : r.quarantined) {
        const FirstStep first = read_first(in, now.bodies.size(), now.step);
        q = {first.number, first.step, in.text(kLongestReason)};
        check(std::ranges::none_of(q.what, [](unsigned char c) { return c < 32 || c == 127; }),
              "a reason with control characters");
    }
    read(in, r.limited, now.bodies.size(), now.step);
    read(in, r.broken, scene.world.constraints.size(), now.step);
}

RunState read_state(std::span<const std::uint8_t> bytes, const WorldScene& scene) {
    ByteReader in(bytes);
    RunState state;
    state.world = read_snapshot(in);
    check_fits(state.world, scene);
    read_result(in, scene, state.world, state.result);
    in.expect_end();
    return state;
}

}  // namespace

std::vector<std::uint8_t> encode(const RunState& state) {
    ByteWriter out;
    write(out, state.world);
    const DistributedResult& r = state.result;
    visit_numbers(r, [&](const auto& number) { out.number(number); });
    out.count(r.quarantined.size());
    for (const QuarantinedBody& q : r.quarantined) {
        out.number(static_cast<std::uint32_t>(q.body));
        out.number(q.step);
        out.text(q.what.substr(0, kLongestReason));
    }
    write(out, r.limited);
    write(out, r.broken);
    return std::move(out.bytes());
}

RunState decode_run_state(std::span<const std::uint8_t> bytes, const WorldScene& scene) {
    try {
        return read_state(bytes, scene);
    } catch (const DecodeError& wrong) {
        throw InputError("", wrong.what(), "the state of a run of this scene");
    }
}

}  // namespace sim
