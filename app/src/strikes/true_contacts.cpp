#include "strikes/true_contacts.h"

#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "kit/tip_track.h"
#include "strikes/strike_score.h"

namespace app {
namespace {

constexpr double kDepthM = 0.003;
constexpr double kRearmM = 0.003;
constexpr double kStepM = 0.0005;  // finest step along a path: a 3 mm dip is at least 6 steps long
constexpr double kTurnEarlyS = 0.025;

/// One tip over one instrument, walked along the straight pieces of its path.
class Crossing {
public:
    Crossing(const sim::BodyDefinition& body, double radius) : body_(body), radius_(radius) {}

    void start(const Eigen::Vector3d& tip) {
        armed_ = clearance(tip) > 0;
        entered_ = false;
    }

    /// From a at time ta to b at time tb; calls found(contact) for each contact confirmed on the way.
    template <class Found>
    void walk(const Eigen::Vector3d& a, double ta, const Eigen::Vector3d& b, double tb, const Found& found) {
        const double length = (b - a).norm();
        if (!(length > 0)) return;
        double x = 0;
        double distance = clearance(a);
        while (x < length) {
            // Far from the surface the distance itself is a safe step; half of it allows for its error.
            const double next = std::min(length, x + std::max(kStepM, 0.5 * std::abs(distance)));
            const double before = distance;
            distance = clearance(a + (b - a) * (next / length));
            if (armed_ && before > 0 && distance <= 0) enter(a, ta, b, tb, x, next, length);
            if (distance > 0) entered_ = false;
            if (armed_ && entered_ && distance <= -kDepthM) {
                armed_ = false;
                entered_ = false;
                if (sim::rest_zone(body_, entry_.point_world) >= 0) found(entry_);
            }
            if (!armed_ && distance >= kRearmM) armed_ = true;
            x = next;
        }
    }

private:
    [[nodiscard]] double clearance(const Eigen::Vector3d& p) const {
        return sim::rest_distance(body_, p, radius_).distance;
    }

    void enter(const Eigen::Vector3d& a, double ta, const Eigen::Vector3d& b, double tb, double low,
               double high, double length) {
        for (int i = 0; i < 40 && high - low > 1e-9; ++i) {
            const double middle = 0.5 * (low + high);
            (clearance(a + (b - a) * (middle / length)) > 0 ? low : high) = middle;
        }
        const double share = high / length;
        entry_.t_s = ta + (tb - ta) * share;
        entry_.point_world = a + (b - a) * share;
        entry_.speed_mps =
            -(b - a).dot(sim::rest_distance(body_, entry_.point_world, radius_).normal) / (tb - ta);
        entered_ = true;
    }

    const sim::BodyDefinition& body_;
    double radius_;
    bool armed_ = false, entered_ = false;
    TrueContact entry_;
};

/// Height over the plane along a cubic Hermite piece between two nodes, u in [0, 1].
struct Piece {
    const sim::PathNode& a;
    const sim::PathNode& b;
    double height_m;

    [[nodiscard]] double at(double u) const {
        const double dt = b.t_s - a.t_s, v = 1 - u;
        return v * v * (1 + 2 * u) * a.position.y() + u * u * (1 + 2 * v) * b.position.y() +
               u * v * dt * (v * a.velocity.y() - u * b.velocity.y()) - height_m;
    }
    [[nodiscard]] Eigen::Vector3d velocity(double u) const {
        const double dt = b.t_s - a.t_s;
        return 6 * u * (1 - u) / dt * (b.position - a.position) + (1 - u) * (1 - 3 * u) * a.velocity +
               u * (3 * u - 2) * b.velocity;
    }
};

sim::Contact plane_contact(const Piece& piece, double u, bool starts_inside) {
    sim::Contact contact;
    contact.t_s = piece.a.t_s + u * (piece.b.t_s - piece.a.t_s);
    contact.starts_inside = starts_inside;
    contact.depth_m = starts_inside ? -piece.at(0) : 0;
    contact.speed_mps = -piece.velocity(u).y();
    contact.zone = 0;
    contact.point_world = piece.a.position + u * (piece.b.position - piece.a.position);
    return contact;
}

/// Where a piece falls through the plane between u and w, at(u) > 0 >= at(w).
double crossing(const Piece& piece, double u, double w) {
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (u + w);
        (piece.at(middle) > 0 ? u : w) = middle;
    }
    return w;
}

double nearest_approach_s(const TipTrack& track, const sim::BodyDefinition& body, double radius, double from,
                          double to) {
    double best = std::numeric_limits<double>::infinity(), at = from;
    for (std::size_t i = 0; i < track.t_s.size(); ++i) {
        if (track.t_s[i] < from || track.t_s[i] > to) continue;
        const double distance = sim::rest_distance(body, track.tip[i], radius).distance;
        if (distance < best) best = distance, at = track.t_s[i];
    }
    return at;
}

}  // namespace

std::vector<TrueContact> find_true_contacts(std::span<const TipTrack> tracks,
                                            std::span<const sim::BodyDefinition> bodies,
                                            double tip_radius_m) {
    std::vector<TrueContact> contacts;
    for (std::uint32_t stick = 0; stick < tracks.size(); ++stick) {
        const TipTrack& track = tracks[stick];
        if (track.tip.empty()) continue;  // a live stick that sent nothing
        for (std::uint32_t instrument = 0; instrument < bodies.size(); ++instrument) {
            Crossing crossing(bodies[instrument], tip_radius_m);
            crossing.start(track.tip.front());
            for (std::size_t i = 1; i < track.t_s.size(); ++i) {
                if (track.t_s[i] - track.t_s[i - 1] > tracking::kGapS) {
                    crossing.start(track.tip[i]);
                    continue;
                }
                crossing.walk(track.tip[i - 1], track.t_s[i - 1], track.tip[i], track.t_s[i],
                              [&](TrueContact contact) {
                                  contact.stick = stick;
                                  contact.instrument = instrument;
                                  contacts.push_back(contact);
                              });
            }
        }
    }
    std::stable_sort(contacts.begin(), contacts.end(),
                     [](const TrueContact& a, const TrueContact& b) { return a.t_s < b.t_s; });
    return contacts;
}

std::vector<TrueContact> find_plane_contacts(const TipTrack& track, double height_m) {
    std::vector<TrueContact> contacts;
    bool armed = track.tip.front().y() > height_m, entered = false;
    TrueContact entry;
    for (std::size_t i = 1; i < track.t_s.size(); ++i) {
        const double before = track.tip[i - 1].y() - height_m, now = track.tip[i].y() - height_m;
        const double dt = track.t_s[i] - track.t_s[i - 1];
        if (dt > tracking::kGapS) {
            armed = now > 0;
            entered = false;
            continue;
        }
        if (armed && before > 0 && now <= 0) {
            const double share = before / (before - now);
            entry.t_s = track.t_s[i - 1] + share * dt;
            entry.point_world = track.tip[i - 1] + share * (track.tip[i] - track.tip[i - 1]);
            entry.speed_mps = (before - now) / dt;
            entered = true;
        }
        if (now > 0) entered = false;
        if (armed && entered && now <= -kDepthM) {
            contacts.push_back(entry);
            armed = entered = false;
        }
        if (!armed && now >= kRearmM) armed = true;
    }
    return contacts;
}

std::vector<sim::Contact> plane_contacts(const sim::TipPath& path, double height_m) {
    constexpr int kSteps = 8;  // a millisecond or so each
    std::vector<sim::Contact> contacts;
    double depth = 0;  // since the last contact
    const auto leave = [&] {
        if (!contacts.empty() && !contacts.back().starts_inside && depth < kDepthM) contacts.pop_back();
        depth = 0;
    };
    bool inside = false;
    for (std::size_t i = 0; i + 1 < path.nodes.size(); ++i) {
        const Piece piece{path.nodes[i], path.nodes[i + 1], height_m};
        if (i == 0 && piece.at(0) <= 0) {
            contacts.push_back(plane_contact(piece, 0, true));
            inside = true;
        }
        for (int step = 0; step < kSteps; ++step) {
            const double u = static_cast<double>(step) / kSteps, w = static_cast<double>(step + 1) / kSteps;
            const double height = piece.at(w);
            if (height <= 0 && !inside)
                contacts.push_back(plane_contact(piece, crossing(piece, u, w), false));
            if (height > 0 && inside) leave();
            inside = height <= 0;
            if (inside) depth = std::max(depth, -height);
        }
    }
    return contacts;
}

void count_turns(StrikeScore& score, std::span<const Strike> strikes, std::span<const TrueContact> contacts,
                 std::span<const TipTrack> tracks, std::span<const sim::BodyDefinition> bodies,
                 double tip_radius_m, double release_margin_s) {
    std::set<std::uint64_t> matched;
    for (const TrueContact& contact : contacts) matched.insert(contact.matched_id);
    for (const Strike& strike : strikes) {
        if (strike.outcome != Outcome::released || matched.contains(strike.id)) continue;
        const double turn =
            nearest_approach_s(tracks[strike.stick], bodies[strike.instrument], tip_radius_m,
                               strike.scheduled_at_s - 0.1, strike.onset_s + release_margin_s);
        const bool early = turn <= strike.onset_s - release_margin_s - kTurnEarlyS;
        ++(early ? score.false_turned_early : score.false_turned_late);
    }
}

}  // namespace app
