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

/// When a predicted contact becomes a note, until when the note may still change, and which contacts make
/// none.
struct StrikeRules {
    double t0_s = 0;                  ///< time of audio sample 0
    double release_margin_s = 0.010;  ///< a note is fixed this long before its onset
    /// A note's time is fixed this long before its onset, >= release_margin_s: in `play` at its release, in
    /// `compare` the lead ahead.
    double commit_lead_s = 0.010;
    double late_s = 0.030;    ///< a stroke found later than this after its contact is not played
    double revive_s = 0.030;  ///< a contact predicted again this near to a cancelled onset keeps its id
    double rearm_m =
        0.003;  ///< the tip must rise this far, and be this far outside, before it can strike again
    double minimum_speed_mps = 0.2;  ///< slower contacts make no note
    int settling_samples = 3;        ///< samples after a start of the filter that make no strike
    bool cancelling = true;          ///< false: a note whose onset lies within sent_lead_s is played
    double sent_lead_s = std::numeric_limits<double>::infinity();
};

/// What one of a predictor's models predicts after a sample.
struct ModelContacts {
    std::span<const sim::Contact> contacts;  ///< of its predicted path, by time
    /// Signed distances [m] of its tip at lead 0 from each instrument's surface grown by the tip's radius
    std::span<const double> clearance_m;
    /// By instrument: notes that will be fixed before the next sample, and whose onset lies before this, are
    /// cancelled (DecidedStrikes); empty: none.
    std::span<const double> silent_until_s = {};
};

/// What the measured tip did by a sample.
struct MeasuredTip {
    std::span<const double>
        clearance_m;  ///< [m] signed, from each instrument's surface grown by the tip's radius
    std::span<const sim::Contact> passed =
        {};  ///< with instruments that it went right through since the sample before
};

/// Turns predicted contacts into strikes.
///
/// Contacts: every (stick, instrument, model) holds a list of pending contacts that each new sample confirms,
/// moves or cancels until their release point. Doubles are prevented by geometry alone: after a release the
/// list takes no contact until the tip, as measured and as filtered, has risen `rearm_m` from its lowest
/// point and is `rearm_m` outside the surface. With a commit lead beyond the release margin a contact's time
/// stands from that lead on, while it may still be cancelled, and taken up again.
///
/// Strikes: the pending contacts of the selected model are those that are played. When the selection changes,
/// a strike goes on with the new model's contact within `revive_s` of it, or is cancelled. When the selected
/// model has already released its own contact of a stroke, while it was not selected, another model's contact
/// within `late_s` of that is played. One stroke makes one note: of several models none is released after a
/// note until the measured tip has risen `rearm_m`. With one model every pending contact is a strike.
///
/// Causal: the call for a sample at s changes only notes with onset >= s + release margin. Times in seconds
/// of the trace's clock.
class StrikeScheduler {
public:
    StrikeScheduler(const StrikeRules& rules, std::size_t sticks, std::size_t instruments);

    /// Before the samples at s: releases the notes whose release point lies before s. Notes before `fixed_s`
    /// are sounding already (in real time, when a sample comes late): they are released, too, and none is
    /// placed there.
    void advance_to(double s, double fixed_s = -std::numeric_limits<double>::infinity());
    /// The filter of `stick` starts anew: its next sample is a first sample.
    void restart(std::uint32_t stick);
    /// Takes the sample of `stick` at time s: the contacts of each model, the same number of models at every
    /// sample, and which one is selected.
    void sample(std::uint32_t stick, double s, std::span<const ModelContacts> expected, std::size_t selected,
                const MeasuredTip& tip);
    /// After the last sample: releases the pending contacts, as when a sensor falls silent.
    void finish();

    [[nodiscard]] const std::vector<Strike>& strikes() const { return strikes_; }
    /// Ids of the strikes whose notes have changed since the last call, in order, for the audio to follow: a
    /// note stands as strikes()[id - 1] says; that of a cancelled strike is gone.
    [[nodiscard]] std::vector<std::uint64_t> take_changes();
    /// Ids released since the last call, in order.
    [[nodiscard]] std::vector<std::uint64_t> take_released();

private:
    /// One stick above one instrument, by one model. A pending contact is kept as the strike that it would
    /// make, with the id of the strike that it has made, 0 for none.
    struct Approach {
        std::uint32_t stick = 0, model = 0;
        bool armed = false;
        double lowest_measured = std::numeric_limits<double>::infinity();  ///< since it was disarmed [m]
        double lowest_filtered = std::numeric_limits<double>::infinity();
        std::optional<double> entered_s;  ///< the measured tip entered the surface since it was armed
        double last_clearance = 0, last_s = 0;
        double interval_s = 0;          ///< between its newest samples
        std::vector<Strike> pending;    ///< in order of first prediction
        std::vector<Strike> cancelled;  ///< newest last; a few
        /// Onset of its contact that was released last while another model was selected.
        double passed_by_s = -std::numeric_limits<double>::infinity();
    };
    /// The last note of a stick on an instrument, until the tip has risen.
    struct Struck {
        double onset_s;
        double lowest_m = std::numeric_limits<double>::infinity();  ///< of the measured tip since the onset
    };
    /// One stick and one instrument.
    struct Pair {
        std::vector<Approach> approaches;  ///< a model each; none before the first sample
        std::size_t selected = 0;          ///< model
        std::optional<Struck> struck;
        std::vector<std::uint64_t> strikes;  ///< ids of those pending or cancelled, newest last; a few

        /// With several models the arming of one does not prevent doubles: it does not know the others'
        /// notes.
        [[nodiscard]] bool is_closed() const { return struck && approaches.size() > 1; }
    };
    /// A contact of the predicted path that may be a strike.
    struct Candidate {
        const sim::Contact* contact;
        double happens_s;  ///< its time, or that at which the measured tip entered
        bool late;         ///< too late for a new note; it may confirm one whose time stands
    };

    Strike& strike(std::uint64_t id) { return strikes_[id - 1]; }
    [[nodiscard]] const Strike& strike(std::uint64_t id) const { return strikes_[id - 1]; }

    void follow_path(Approach& a, double s, std::span<const sim::Contact> contacts);
    void update_arming(Approach& a, double s, double measured, double filtered, bool first) const;
    static void disarm(Approach& a);
    [[nodiscard]] std::vector<Candidate> candidates(const Approach& a, double s,
                                                    std::span<const sim::Contact> contacts) const;
    /// None where it is too late for a note.
    [[nodiscard]] std::optional<Strike> new_contact(Approach& a, double s, const Candidate& candidate) const;
    /// Earliest onset that the sample at s may ask for.
    [[nodiscard]] double earliest_onset(double s) const {
        return std::max(s + rules_.commit_lead_s, fixed_s_);
    }
    void place_onset(Strike& pending, double s) const;
    [[nodiscard]] bool is_committed(const Strike& pending, double s) const;
    /// Whether a candidate may be the pending contact itself. A contact whose time stands is not confirmed by
    /// one that would come more than late_s after it; one that would come sooner will sound late.
    [[nodiscard]] bool may_be(const Strike& pending, const Candidate& candidate, double s) const;
    /// Handles a pending contact that the path no longer shows.
    void keep_or_cancel(Approach& a, double s, Strike& pending, bool may_keep) const;
    /// Cancels contacts with an onset before `until_s` that will be fixed before the next sample. That one is
    /// expected after the same interval as the last.
    void silence(Approach& a, double s, double until_s) const;
    static void cancel(Approach& a, Strike& pending);

    /// Makes the strikes of a pair those that are to be played of its pending contacts.
    void play_selected(Pair& pair, double s);
    /// Opens the surface to all models when the tip has risen since the last note.
    void open_again(Pair& pair, double s, double measured) const;
    /// Whether a contact's model is selected, or the selected model has released its own contact of the same
    /// stroke.
    [[nodiscard]] bool is_selected(const Pair& pair, const Strike& pending) const;
    /// The pending contact becomes a strike, or the strike that it has made follows it.
    void play(Pair& pair, Strike& pending, double s, std::span<const std::uint64_t> played);
    /// The strike that a contact of a newly selected model goes on with; 0 for none.
    [[nodiscard]] std::uint64_t taken_over(const Pair& pair, const Strike& pending,
                                           std::span<const std::uint64_t> played) const;
    void withdraw(std::uint64_t id, double s);
    void release_before(double until);
    void release(Pair& pair, Approach& a, const Strike& pending);

    StrikeRules rules_;
    std::size_t instruments_;
    double fixed_s_ = -std::numeric_limits<double>::infinity();
    std::vector<Pair> pairs_;  // stick-major
    std::vector<int> samples_since_start_;
    std::vector<Strike> strikes_;
    std::vector<std::uint64_t> changes_, released_;
};

}  // namespace app
