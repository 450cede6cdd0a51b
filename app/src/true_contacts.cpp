#include "true_contacts.h"

#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

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
