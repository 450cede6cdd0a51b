#include <algorithm>
#include <cmath>
#include <string>

#include "messages/world_record_codec.h"
#include "shared/replica.h"
#include "sim/errors.h"
#include "contact/manifold.h"

namespace sim {
namespace {

//   snapshot as in worker_messages.h
//   f64 elapsed s, cpu s; i32 workers, lost, left, bodies reowned, largest lead, largest ghost age;
//   u64 migrations, trades, cross contacts, bytes, bytes of states, of links, records, refused messages
//   i32 contacts, pairs, islands, asleep; u64 inverse fallbacks, deformations limited, constraints broken, impacts,
//   solved again, held apart
//   list of quarantined {u32 body, u64 step, text}; lists of limited and of broken {u32 number, u64 step}
//   list of outside {u32 worker, v3 impulse}

constexpr std::size_t kQuarantinedBytes = 16, kFirstBytes = 12, kOutsideBytes = 28;
constexpr std::uint32_t kLongestReason = 4096;

/// Every number of a result, in order; `result` may be const.
template <typename Result, typename Visit>
void visit_numbers(Result& r, Visit visit) {
    visit(r.elapsed_s), visit(r.cpu_s);
    visit(r.workers), visit(r.lost), visit(r.left), visit(r.bodies_reowned);
    visit(r.largest_lead), visit(r.largest_ghost_age);
    visit(r.migrations), visit(r.trades), visit(r.cross_contacts), visit(r.bytes), visit(r.bytes_states);
    visit(r.bytes_linked), visit(r.records), visit(r.refused_messages);
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
    for (std::uint32_t left = in.count(kOutsideBytes); left > 0; --left) {
        Eigen::Vector3d& impulse = state.outside[in.number<std::uint32_t>()];
        in.matrix(impulse);
        check(impulse.allFinite(), "an impulse that is not finite");
    }
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
    out.count(state.outside.size());
    for (const auto& [worker, impulse] : state.outside) {
        out.number(worker);
        out.matrix(impulse);
    }
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
