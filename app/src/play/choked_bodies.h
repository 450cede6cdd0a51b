#pragma once
#include <audio/performance.h>
#include <sim/simulation.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "kit/kit.h"

namespace app {

/// Chokes bring bodies to rest: the body whose sound is ended by a hand, a foot, a tip or a stroke of its
/// choke group.
///
/// A choke of an instrument at c, known at s, ends the response to every impulse from before c. Its weight
/// goes from 1 at max(c, s + render lead) to 0 within 100 ms, with a slope that is 0 at both ends. A frame at
/// T knows what was known at T - render lead, so it never shows a jump. Once the weight is 0 the response is
/// also taken out of the body's exact state, so that contacts find the body where pictures show it. An
/// opposite impulse does that, since a state is linear in its impulses. A stroke of the instrument itself
/// ends its older sound, not its motion.
///
/// One thread. A pure function of the calls.
class ChokedBodies {
public:
    /// t0_s: time of sample 0.
    ChokedBodies(const Kit& kit, double t0_s, double render_lead_s);

    /// A stroke or a choke that sounds, known at s.
    void take(const audio::Note& note, double s = -std::numeric_limits<double>::infinity());
    /// A choke of an instrument at c, known at s.
    void end(std::uint32_t instrument, double c, double s);
    /// The weight at T of the response to an impulse; it never grows.
    [[nodiscard]] double weight(const sim::Impulse& impulse, double T) const;

    /// A strike's impulse that has become part of a body's exact state.
    struct Folded {
        std::uint64_t id = 0;
        sim::Impulse impulse;
    };
    void folded(const Folded& strike);
    /// Those that may still move bodies, in the order in which they were folded.
    [[nodiscard]] const std::vector<Folded>& moving() const { return moving_; }
    /// Removes and returns those that weigh nothing from s on, and forgets those that have died away.
    [[nodiscard]] std::vector<Folded> take_stopped(double s);

private:
    struct Choke {
        double at_s, begins_s;
    };
    struct Chokable {
        std::string group;
        double dies_away_s;  ///< from an impulse on
        std::vector<Choke> chokes{};
    };
    double t0_s_, render_lead_s_;
    std::vector<Chokable> bodies_;  // by instrument
    std::vector<Folded> moving_;
};

}  // namespace app
