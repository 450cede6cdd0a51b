#include <algorithm>
#include <cmath>

#include "contact/step_contacts.h"

// Fast pairs: impacts on paths of free motion, and on those really taken.

namespace sim {
namespace {

// A pair that touches already meets once more where it is this deep inside each other, shares of the smallest
// semi-axes; bent bodies may be pressed in. With every impact within the step a little deeper.
constexpr double kInside = 0.1, kInsideBent = 0.5, kDeeper = 0.05, kDeepest = 0.9;

double size_of(const MovingBody& a, const MovingBody& b) {
    return std::min(smallest_half(a.posed), smallest_half(b.posed));
}

// Whether surfaces moved against each other by more than `least` [m] on their paths.
bool is_far(const BodyPath& pa, const BodyPath& pb, double least, const MovingBody& a, const MovingBody& b) {
    double sum = 0;
    along(pa, pb, 0, [&](const BodyPath::Leg& of_a, const BodyPath::Leg& of_b, double span) {
        sum += span * ((of_a.velocity - of_b.velocity).norm() + of_a.spin.norm() * turn_reach_of(*a.kind) +
                       of_b.spin.norm() * turn_reach_of(*b.kind));
        return sum <= least;
    });
    return sum > least;
}

// A pair's impacts in their order.
bool by_key(const Manifold& a, const Manifold& b) {
    return a.key() != b.key() ? a.key() < b.key() : a.points[0].begins < b.points[0].begins;
}

}  // namespace

const Manifold* StepContacts::find_last(std::uint64_t key) {
    const auto at = std::lower_bound(before_.begin(), before_.end(), key,
                                     [](const Manifold& m, std::uint64_t k) { return m.key() < k; });
    if (at == before_.end() || at->key() != key) return nullptr;
    return &*at;
}

Manifold* StepContacts::find_now(std::uint64_t key) {
    const auto at = std::lower_bound(manifolds_.begin(), manifolds_.end(), key,
                                     [](const Manifold& m, std::uint64_t k) { return m.key() < k; });
    return at != manifolds_.end() && at->key() == key ? &*at : nullptr;
}

int StepContacts::impacts_of(int i, int j) const {
    const auto count = std::count_if(manifolds_.begin(), manifolds_.end(), [&](const Manifold& m) {
        return m.a == i && m.b == j && m.points[0].begins >= 0;
    });
    return static_cast<int>(count);
}

void StepContacts::rewarm(Manifold& manifold) {
    for (ManifoldPoint& point : manifold.points) point.normal_impulse = 0, point.friction_impulse.setZero();
    const Manifold* before = find_last(manifold.key());
    if (before && manifold.points[0].begins < 0) take_impulses(*before, manifold.impulse_reach, manifold);
}

void StepContacts::follow(const ContactScene& scene, int i, const WorldBodyState& from) {
    const auto at = static_cast<std::size_t>(i);
    if (scene.bodies[at].driven) return;
    // Once, whichever thread asks first.
    const std::atomic_ref<std::uint8_t> state(followed_[at]);
    std::uint8_t now = kNotFollowed;
    if (state.compare_exchange_strong(now, kBeingFollowed)) {
        follow_freely(scene.bodies[at], from, scene.settings, paths_[at]);
        state.store(kFollowed);
    }
    for (ShortWait wait; state != kFollowed;) (void)wait.again();
}

Impact StepContacts::foresee(const ContactScene& scene, int i, int j) {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    follow(scene, i, a.state), follow(scene, j, b.state);
    return time_of_impact(ConvexBody(a.posed), paths_[static_cast<std::size_t>(i)], ConvexBody(b.posed),
                          paths_[static_cast<std::size_t>(j)], kTouching * size_of(a, b));
}

// The time of each moving body's first meeting.
void StepContacts::note_first(const ContactScene& scene, std::span<const Meeting> meetings) {
    for (const Meeting& m : meetings)
        for (const int id : {m.a, m.b}) first_[static_cast<std::size_t>(id)] = 1e300;
    for (const Meeting& m : meetings)
        for (const int id : {m.a, m.b}) {
            double& first = first_[static_cast<std::size_t>(id)];
            if (scene.bodies[static_cast<std::size_t>(id)].moves()) first = std::min(first, m.time);
        }
}

// By more than a substep after the first of those that were noted.
bool StepContacts::is_late(const ContactScene& scene, const Meeting& m) const {
    return m.time >
           scene.settings.dt / scene.settings.substeps +
               std::min(first_[static_cast<std::size_t>(m.a)], first_[static_cast<std::size_t>(m.b)]);
}

// Keeps of a moving body's meetings those within a substep of its first, which may keep it from the others, and
// of these those that are contacts.
void StepContacts::accept_impacts(const ContactScene& scene) {
    const auto sorted = static_cast<std::ptrdiff_t>(manifolds_.size());
    note_first(scene, meetings_);
    std::erase_if(meetings_, [&](const Meeting& m) { return is_late(scene, m); });
    added_.resize(meetings_.size());
    find_impacts(scene, meetings_, {added_.data(), added_.size()});
    std::size_t found = 0;
    for (std::size_t i = 0; i < meetings_.size(); ++i) {
        const Meeting& m = meetings_[i];
        if (added_[i].count == 0) continue;
        watch_turning(m.a, m.b,
                      kSlow * size_of(scene.bodies[static_cast<std::size_t>(m.a)],
                                      scene.bodies[static_cast<std::size_t>(m.b)]));
        added_[found] = added_[i], meetings_[found++] = m;
    }
    meetings_.resize(found), added_.resize(found);
    impacts_ += found;
    // Those that were added, into their places.
    manifolds_.insert(manifolds_.end(), added_.begin(), added_.end());
    std::sort(added_.begin(), added_.end(), by_key);
    auto to = manifolds_.end(), from = manifolds_.begin() + sorted;
    for (std::size_t left = added_.size(); left > 0; --to) {
        const bool old = from != manifolds_.begin() && by_key(added_[left - 1], *std::prev(from));
        *std::prev(to) = old ? *--from : added_[left - 1];
        if (!old) --left;
    }
}

void StepContacts::find_impacts(const ContactScene& scene, std::span<const Meeting> meetings,
                                std::span<Manifold> impacts) {
    at_.resize(std::max(at_.size(), static_cast<std::size_t>(scene.crew.size())));
    scene.crew.each(meetings.size(), 4, [&](int thread, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            find_impact(scene, meetings[i], static_cast<std::size_t>(thread), impacts[i]);
    });
}

// The contact of a pair where its paths bring it at a time. Its separation now is what its rows, which stand
// still over the step, close until then. Without points: it has none there.
void StepContacts::find_impact(const ContactScene& scene, const Meeting& meeting, std::size_t thread,
                               Manifold& manifold) {
    const int ids[2] = {meeting.a, meeting.b};
    BodyPath::Way way[2];
    for (std::size_t side = 0; side < 2; ++side) {
        const auto id = static_cast<std::size_t>(ids[side]);
        const BodyPath::Pose pose = paths_[id].at(meeting.time);
        PosedBody& posed = at_[thread][side];
        posed.kind = scene.bodies[id].kind;
        posed.set(pose.position, pose.orientation, scene.bodies[id].state.q);
        way[side] = paths_[id].until(meeting.time);
    }
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(meeting.a)],
                     &b = scene.bodies[static_cast<std::size_t>(meeting.b)];
    manifold = {};
    manifold.a = meeting.a, manifold.b = meeting.b;
    const float margin = static_cast<float>(kSlow * size_of(a, b));
    narrow_[thread]->pair(at_[thread][0], at_[thread][1],
                          {margin, find_last(manifold.key()), scene.may_part(a, b), true}, manifold);
    if (manifold.count == 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(manifold.count); ++i) {
        ManifoldPoint& p = manifold.points[i];
        const Eigen::Vector3d n = p.normal.cast<double>();
        const double closed =
            n.dot(way[0].moved - way[1].moved + way[0].turned.cross(p.arm_a.cast<double>()) -
                  way[1].turned.cross(p.arm_b.cast<double>()));
        const double gap = std::max(static_cast<double>(p.separation), 0.0);
        p.gap = gap > 2 * kTouching * size_of(a, b) ? static_cast<float>(gap) : 0;
        p.separation = static_cast<float>(gap - closed);
        p.begins = static_cast<float>(meeting.time);
        p.normal_impulse = 0, p.friction_impulse.setZero();
    }
    manifold.emerging = false;
    scene.set_surface(manifold);
}

void StepContacts::replace(const std::vector<int>& bodies, const std::vector<Manifold>& by) {
    std::erase_if(manifolds_, [&](const Manifold& m) {
        return std::binary_search(bodies.begin(), bodies.end(), m.a) ||
               std::binary_search(bodies.begin(), bodies.end(), m.b);
    });
    manifolds_.insert(manifolds_.end(), by.begin(), by.end());
    std::sort(manifolds_.begin(), manifolds_.end(), by_key);
}

void StepContacts::keep_last() {
    const auto again = [](const Manifold& a, const Manifold& b) { return a.key() == b.key(); };
    auto kept = manifolds_.begin();
    for (auto next = manifolds_.begin(); next != manifolds_.end(); ++next) {
        if (kept != manifolds_.begin() && again(*std::prev(kept), *next)) --kept;
        if (kept != next) *kept = *next;
        ++kept;
    }
    manifolds_.erase(kept, manifolds_.end());
}

// Whether the solved motion differs from the free one by more than slow pairs may move.
bool StepContacts::left_path(const ContactScene& scene, int i) const {
    if (watched_[static_cast<std::size_t>(i)] != 0) return true;
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(i)];
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    const double least = kSlow * smallest_half(body.posed);
    const Eigen::Vector3d aside = body.state.position - body.posed.position - reach.moved;
    if (aside.squaredNorm() > least * least) return true;
    return scene.settings.dt * turning_speed(body) > reach.turned + least;
}

bool StepContacts::any_left_path(const ContactScene& scene, const std::vector<std::uint8_t>& solved) const {
    return std::ranges::any_of(scene.participants, [&](int id) {
        return solved[static_cast<std::size_t>(id)] != 0 && left_path(scene, id);
    });
}

// Bodies that left their free paths, against all that their paths come near.
const std::vector<StepContacts::Meeting>& StepContacts::unforeseen(
    const ContactScene& scene, const std::vector<std::uint8_t>& solved,
    const std::vector<WorldBodyState>& started) {
    meetings_.clear();
    if (!any_left_path(scene, solved)) return meetings_;
    auto& boxes = broad_.boxes();
    boxes.clear();
    for (const int id : scene.participants) {
        const auto at = static_cast<std::size_t>(id);
        const MovingBody& body = scene.bodies[at];
        const bool left = solved[at] != 0 && left_path(scene, id);
        if (solved[at] == 0) {
            follow(scene, id, body.moves() && !body.asleep ? started[at] : body.state);
        } else {
            set_spins(body, paths_[at]);
        }
        Eigen::Vector3d low = body.posed.position, high = low;
        for (std::size_t i = 0; i < paths_[at].legs.size(); ++i) {
            const BodyPath::Leg& leg = paths_[at].legs[i];
            const Eigen::Vector3d end = leg.position + (paths_[at].end_of(i) - leg.start) * leg.velocity;
            low = low.cwiseMin(leg.position).cwiseMin(end), high = high.cwiseMax(leg.position).cwiseMax(end);
        }
        const double radius = static_cast<double>(body.posed.radius);
        boxes.push_back({low.array() - radius, high.array() + radius, id, left});
    }
    for (const auto& pair : broad_.find(scene.crew))
        if (scene.may_meet(pair)) meet_unforeseen(scene, pair.first, pair.second);
    if (meetings_.empty()) return meetings_;
    accept_impacts(scene);
    return meetings_;
}

void StepContacts::meet_unforeseen(const ContactScene& scene, int i, int j) {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    if (!a.moves() && !b.moves()) return;
    const BodyPath &pa = paths_[static_cast<std::size_t>(i)], &pb = paths_[static_cast<std::size_t>(j)];
    const double size = size_of(a, b);
    const std::uint64_t key = static_cast<std::uint64_t>(i) << 32 | static_cast<std::uint32_t>(j);
    const bool now = find_now(key) || std::ranges::find(known_, key) != known_.end();
    if (now && !is_far(pa, pb, kSlow * size, a, b)) return;
    const bool bent = is_bent(a.posed) || is_bent(b.posed);
    const double inside =
        now ? std::min((bent ? kInsideBent : kInside) + kDeeper * impacts_of(i, j), kDeepest) : 0;
    const ConvexBody of_a(a.posed, inside * size), of_b(b.posed, inside * size);
    const Impact impact = time_of_impact(of_a, pa, of_b, pb, kTouching * size);
    if (!impact.meets || (impact.at_once && now)) return;
    meetings_.push_back({i, j, impact.time, now});
}

}  // namespace sim
