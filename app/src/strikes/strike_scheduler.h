#pragma once
#include <sim/simulation.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "strikes/strike.h"

namespace app {

/// The constants of a strike's life (the strike rules of the README).
struct StrikeRules {
    double t0_s = 0;                  ///< time of audio sample 0
    double release_margin_s = 0.010;  ///< a note is fixed this long before its onset
    double commit_lead_s = 0.010;     ///< its time is fixed this long before, >= release_margin_s
    double late_s = 0.030;            ///< a stroke found later than this after its contact is not played
    double revive_s = 0.030;  ///< a contact predicted again this near to a cancelled onset keeps its id
    double rearm_m =
        0.003;  ///< the tip must rise this far, and be this far outside, before it can strike again
    double minimum_speed_mps = 0.2;  ///< slower contacts make no note
    int settling_samples = 3;        ///< samples after a start of the filter that make no strike
    bool cancelling = true;          ///< false: a note whose onset lies within sent_lead_s is played
    double sent_lead_s = std::numeric_limits<double>::infinity();
};

/// A change that the audio has to follow: the note of a strike stands as `strikes()[id - 1]` says, or is
/// gone.
struct NoteChange {
    std::uint64_t id = 0;
    bool scheduled = true;  ///< added, moved or re-weighted; false: cancelled
};

/// Turns predicted contacts into strikes: every (stick, instrument) pair holds a list of pending contacts
/// that each new sample confirms, moves or cancels until their release point. Doubles are prevented by
/// geometry alone: after a release the pair makes no strike until the tip, as measured and as filtered, has
/// risen `rearm_m` from its lowest point and is `rearm_m` outside the surface. With a commit lead beyond the
/// release margin a note's time stands from that lead on, while it may still be cancelled, and taken up
/// again. Causal: the call for a sample at s changes only notes with onset >= s + release margin. Times in
/// seconds of the trace's clock.
class StrikeScheduler {
public:
    StrikeScheduler(const StrikeRules& rules, std::size_t sticks, std::size_t instruments);

    /// Before the samples at s: releases the notes whose release point lies before s. Notes before `fixed_s`
    /// are sounding already (in real time, when a sample comes late): they are released, too, and none is
    /// placed there.
    void advance_to(double s, double fixed_s = -std::numeric_limits<double>::infinity());
    /// The filter of `stick` starts anew: its next sample is a first sample.
    void restart(std::uint32_t stick);
    /// The sample of `stick` at time s.
    ///
    ///   contacts            of its predicted path, by time
    ///
    ///   measured_clearance  [m] signed, of the measured tip from each instrument's surface grown by the
    ///   tip's radius
    ///
    ///   filtered_clearance  the same of the filtered tip at lead 0
    ///
    ///   model               that predicts the contacts, of a predictor of several
    void sample(std::uint32_t stick, double s, std::span<const sim::Contact> contacts,
                std::span<const double> measured_clearance, std::span<const double> filtered_clearance,
                std::size_t model = 0);
    /// After the last sample: what is pending is released, as when a sensor falls silent.
    void finish();

    [[nodiscard]] const std::vector<Strike>& strikes() const { return strikes_; }
    /// Changes since the last call, in order.
    [[nodiscard]] std::vector<NoteChange> take_changes();
    /// Ids released since the last call, in order.
    [[nodiscard]] std::vector<std::uint64_t> take_released();

private:
    /// What one stick is doing above one instrument.
    struct Approach {
        bool armed = false;
        double lowest_measured = std::numeric_limits<double>::infinity();  ///< since it was disarmed [m]
        double lowest_filtered = std::numeric_limits<double>::infinity();
        std::optional<double> entered_s;  ///< the measured tip entered the surface since it was armed
        double last_clearance = 0, last_s = 0;
        std::vector<std::uint64_t> pending;    ///< ids by contact time
        std::vector<std::uint64_t> cancelled;  ///< ids, newest last; a few
    };

    Approach& approach(std::uint32_t stick, std::uint32_t instrument);
    Strike& strike(std::uint64_t id) { return strikes_[id - 1]; }
    void update_arming(Approach& a, double s, double measured, double filtered, bool first) const;
    void follow(Approach& a, double s, std::uint32_t stick, std::span<const sim::Contact> contacts,
                bool settled);
    /// A contact of the predicted path that may be a strike.
    struct Candidate {
        const sim::Contact* contact;
        double happens_s;  ///< its time, or that at which the measured tip entered
        bool late;         ///< too late for a new note; it may confirm one whose time stands
    };
    [[nodiscard]] std::vector<Candidate> candidates(const Approach& a, double s,
                                                    std::span<const sim::Contact> contacts) const;
    void create(Approach& a, double s, std::uint32_t stick, const sim::Contact& contact);
    void update(Strike& strike, double s, const sim::Contact& contact);
    /// Earliest onset that the sample at s may ask for.
    [[nodiscard]] double earliest_onset(double s) const {
        return std::max(s + rules_.commit_lead_s, fixed_s_);
    }
    void place_onset(Strike& strike, double s) const;
    [[nodiscard]] bool is_committed(const Strike& strike, double s) const;
    /// Whether a candidate may be the strike's own contact. A note whose time stands is not borne out by a
    /// contact that would come more than late_s after it; one that would come sooner will sound late.
    [[nodiscard]] bool may_be(const Strike& strike, const Candidate& candidate, double s) const;
    void keep_or_cancel(Approach& a, double s, std::uint64_t id, bool may_keep);
    void cancel(Approach& a, double s, std::uint64_t id);
    void release(std::uint64_t id);
    static void disarm(Approach& a);

    StrikeRules rules_;
    std::size_t instruments_;
    double fixed_s_ = -std::numeric_limits<double>::infinity();
    std::uint32_t model_ = 0;           // of the sample at hand
    std::vector<Approach> approaches_;  // stick-major
    std::vector<int> samples_since_start_;
    std::vector<Strike> strikes_;
    std::vector<NoteChange> changes_;
    std::vector<std::uint64_t> released_;
};

}  // namespace app
