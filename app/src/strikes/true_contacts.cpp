#include "strikes/true_contacts.h"

#include <sim/hermite_piece.h>
#include <tracking/predictor.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <compare>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "kit/surface_entry.h"

namespace app {
namespace {

constexpr double kTurnEarlyS = 0.025;

/// What a tip's centre meets: a body at rest, grown by the tip's radius, or a horizontal plane.
struct Surface {
    std::function<sim::SurfacePoint(const Eigen::Vector3d&)> nearest;
    std::function<bool(const Eigen::Vector3d&)> sounds;
    double entry_tolerance_m = 0;

    [[nodiscard]] double distance(const Eigen::Vector3d& p) const { return nearest(p).distance; }
};

/// One recorded tip over one surface, walked along the straight pieces of its path.
class Crossing {
public:
    Crossing(const TipTrack& track, Surface surface) : track_(track), surface_(std::move(surface)) {}

    [[nodiscard]] std::vector<TrueContact> find() {
        start(0);
        for (std::size_t i = 1; i < track_.t_s.size(); ++i) {
            if (track_.t_s[i] - track_.t_s[i - 1] > tracking::kGapS)
                start(i);
            else
                walk_to(i);
        }
        return std::move(found_);
    }

private:
    void start(std::size_t sample) {
        first_ = sample;
        armed_ = surface_.distance(track_.tip[sample]) > 0;
        entry_.reset();
    }

    /// Along the piece that ends at sample `to`.
    void walk_to(std::size_t to) {
        const Eigen::Vector3d &a = track_.tip[to - 1], way = track_.tip[to] - a;
        const double length = way.norm();
        if (!(length > 0)) return;
        const auto distance = [&](double x) { return surface_.distance(a + way * (x / length)); };
        walk(0, length, surface_.distance(a), 1, distance, [&](const WalkStep& step) {
            if (armed_ && step.enters())
                enter(to, entry_between(step.from, step.to, surface_.entry_tolerance_m, distance) / length);
            if (step.now > 0) entry_.reset();
            if (armed_ && entry_ && step.now <= -kContactDepth_m) {
                if (surface_.sounds(entry_->point_world)) found_.push_back(*entry_);
                armed_ = false;
                entry_.reset();
            }
            if (!armed_ && step.now >= kRearm_m) armed_ = true;
        });
    }

    /// Enters after `share` of the piece that ends at sample `to`.
    void enter(std::size_t to, double share) {
        const double ta = track_.t_s[to - 1], tb = track_.t_s[to];
        entry_.emplace();
        entry_->t_s = ta + (tb - ta) * share;
        entry_->point_world = track_.tip[to - 1] + (track_.tip[to] - track_.tip[to - 1]) * share;
        // The piece that enters may hold the rebound, too: the last one before it does not.
        const Eigen::Vector3d normal = surface_.nearest(entry_->point_world).normal;
        entry_->speed_mps = inward_speed(to, normal);
        if (to - 1 > first_) entry_->speed_mps = std::max(entry_->speed_mps, inward_speed(to - 1, normal));
    }

    /// Mean over the piece that ends at sample `to` [m/s].
    [[nodiscard]] double inward_speed(std::size_t to, const Eigen::Vector3d& normal) const {
        return -(track_.tip[to] - track_.tip[to - 1]).dot(normal) / (track_.t_s[to] - track_.t_s[to - 1]);
    }

    const TipTrack& track_;
    Surface surface_;
    std::size_t first_ = 0;  // sample since which there is no gap
    bool armed_ = false;
    std::optional<TrueContact> entry_;  // since the tip is inside
    std::vector<TrueContact> found_;
};

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

/// Times are sums of doubles: a pair of exactly 30 ms counts as within.
constexpr double kTimeSlack_s = 1e-9;

struct Pair {
    double distance_s, contact_s;
    std::uint64_t id;
    std::size_t contact, strike;
    auto operator<=>(const Pair&) const = default;
};

std::vector<Pair> candidate_pairs(const std::vector<Strike>& strikes,
                                  const std::vector<TrueContact>& contacts) {
    const double window_s = kMatchWindow_s + kTimeSlack_s;
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < strikes.size(); ++i) {
        const Strike& strike = strikes[i];
        if (strike.outcome != Outcome::released) continue;
        auto contact = std::ranges::lower_bound(contacts, strike.onset_s - window_s, {}, &TrueContact::t_s);
        for (; contact != contacts.end() && contact->t_s <= strike.onset_s + window_s; ++contact) {
            if (contact->stick != strike.stick || contact->instrument != strike.instrument) continue;
            const auto index = static_cast<std::size_t>(contact - contacts.begin());
            pairs.push_back({std::abs(strike.onset_s - contact->t_s), contact->t_s, strike.id, index, i});
        }
    }
    std::ranges::sort(pairs);
    return pairs;
}

/// Takes the pairs in order, each strike and contact once; returns |onset - contact| of those taken [ms].
std::vector<double> match(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    std::vector<double> errors_ms;
    std::vector<bool> strike_taken(strikes.size()), contact_taken(contacts.size());
    for (TrueContact& contact : contacts) contact.matched_id = 0;
    for (const Pair& pair : candidate_pairs(strikes, contacts)) {
        if (strike_taken[pair.strike] || contact_taken[pair.contact]) continue;
        strike_taken[pair.strike] = contact_taken[pair.contact] = true;
        contacts[pair.contact].matched_id = pair.id;
        errors_ms.push_back(pair.distance_s * 1e3);
    }
    return errors_ms;
}

}  // namespace

std::vector<TrueContact> find_true_contacts(std::span<const TipTrack> tracks,
                                            std::span<const sim::BodyDefinition> bodies,
                                            double tip_radius_m) {
    std::vector<TrueContact> contacts;
    for (std::uint32_t stick = 0; stick < tracks.size(); ++stick) {
        if (tracks[stick].tip.empty()) continue;  // a live stick that sent nothing
        for (std::uint32_t instrument = 0; instrument < bodies.size(); ++instrument) {
            const sim::BodyDefinition& body = bodies[instrument];
            const Surface surface{
                [&](const Eigen::Vector3d& p) { return sim::rest_distance(body, p, tip_radius_m); },
                [&](const Eigen::Vector3d& p) { return sim::rest_zone(body, p) >= 0; }, 1e-9};
            for (TrueContact& contact : Crossing(tracks[stick], surface).find()) {
                contact.stick = stick;
                contact.instrument = instrument;
                contacts.push_back(contact);
            }
        }
    }
    std::ranges::stable_sort(contacts, {}, &TrueContact::t_s);
    return contacts;
}

std::vector<TrueContact> find_plane_contacts(const TipTrack& track, double height_m) {
    const auto nearest = [=](const Eigen::Vector3d& p) {
        return sim::SurfacePoint{p.y() - height_m, Eigen::Vector3d::UnitY()};
    };
    return Crossing(track, {nearest, [](const Eigen::Vector3d&) { return true; }}).find();
}

std::vector<sim::Contact> plane_contacts(const sim::TipPath& path, double height_m) {
    constexpr double kEntryToleranceS = 1e-12;
    std::vector<sim::Contact> contacts;
    double height = path.nodes.front().position.y() - height_m;
    double depth = 0;  // since the last contact
    const auto leave = [&] {
        if (!contacts.empty() && !contacts.back().starts_inside && depth < kContactDepth_m)
            contacts.pop_back();
        depth = 0;
    };
    for (std::size_t i = 0; i + 1 < path.nodes.size(); ++i) {
        const sim::HermitePiece piece(path.nodes[i], path.nodes[i + 1]);
        const auto add = [&](double t_s) -> sim::Contact& {
            sim::Contact& contact = contacts.emplace_back();
            contact.t_s = t_s;
            contact.speed_mps = -piece.velocity(t_s).y();
            contact.zone = 0;
            contact.point_world = piece.position(t_s);
            return contact;
        };
        const auto height_at = [&](double t_s) { return piece.position(t_s).y() - height_m; };
        if (i == 0 && height <= 0) {
            sim::Contact& first = add(piece.t0_s);
            first.starts_inside = true;
            first.depth_m = -height;
        }
        height = walk(piece.t0_s, piece.t1_s, height, piece.greatest_speed(), height_at,
                      [&](const WalkStep& step) {
                          if (step.enters())
                              add(entry_between(step.from, step.to, kEntryToleranceS, height_at));
                          if (step.leaves()) leave();
                          depth = std::max(depth, -step.now);
                      });
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

std::optional<StrikeDynamics> dynamics_of(const Strike& strike, const TrueContact& contact) {
    if (!(contact.speed_mps > 0) || !(strike.speed_mps > 0)) return std::nullopt;
    const double ratio = strike.speed_mps / contact.speed_mps;
    const Eigen::Vector3d& n = strike.normal_world;
    const Eigen::Vector3d away = strike.point_world - contact.point_world;
    return StrikeDynamics{100 * (ratio - 1), 20 * std::log10(ratio), 1e3 * (away - n.dot(away) * n).norm()};
}

StrikeScore score_strikes(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    assert(std::ranges::is_sorted(contacts, {}, &TrueContact::t_s) && "the true contacts are sorted by time");
    const std::vector<double> errors_ms = match(strikes, contacts);
    const int matched = static_cast<int>(errors_ms.size());
    StrikeScore score;
    score.true_contacts = static_cast<int>(contacts.size());
    for (const Strike& strike : strikes) {
        score.released += strike.outcome == Outcome::released;
        score.cancelled += strike.outcome == Outcome::cancelled;
        score.moved += strike.outcome == Outcome::released && strike.moves > 0;
    }
    score.false_notes = score.released - matched;
    score.missed = score.true_contacts - matched;
    score.timing_median_ms = median(errors_ms);
    score.timing_p95_ms = quantile(errors_ms, 0.95);
    std::vector<double> percent, db, place_mm;
    for (const TrueContact& contact : contacts) {
        if (contact.matched_id == 0) continue;
        const auto dynamics = dynamics_of(strikes[contact.matched_id - 1], contact);
        if (!dynamics) continue;
        percent.push_back(std::abs(dynamics->speed_percent));
        db.push_back(std::abs(dynamics->speed_db));
        place_mm.push_back(dynamics->place_mm);
    }
    score.speed_median_percent = median(percent);
    score.speed_p95_percent = quantile(percent, 0.95);
    score.speed_median_db = median(db);
    score.speed_p95_db = quantile(db, 0.95);
    score.place_median_mm = median(place_mm);
    score.place_p95_mm = quantile(place_mm, 0.95);
    return score;
}

}  // namespace app
