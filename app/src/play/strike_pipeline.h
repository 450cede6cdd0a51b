#pragma once
#include <audio/performance.h>
#include <sim/simulation.h>
#include <tracking/known_motion.h>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "kit/kit.h"
#include "play/choked_bodies.h"
#include "play/play.h"
#include "process/clock.h"
#include "sticks/stick.h"
#include "strikes/contact_forecast.h"
#include "strikes/strike.h"
#include "strikes/strike_decision.h"
#include "strikes/strike_scheduler.h"
#include "strikes/tip_rests.h"

namespace app {

/// The strikes as pictures show them. A contact is drawn, with the impulse known then, by the first frame
/// that is shown after it; if it is cancelled later its response fades within 100 ms, and if it moves before
/// its release the response passes over to the final one in the same time: never a jump. What is choked weighs what
/// ChokedBodies says. Frames must come in order. One thread.
class DrawnStrikes {
public:
    /// A released strike's impulse has become part of the bodies' exact states.
    void folded(std::uint64_t id) { mark(id).folded = true; }
    /// It was taken out of them again, choked.
    void stopped(std::uint64_t id) { mark(id).stopped = true; }
    /// What the frame shown at T adds to the exact states, given the strikes as known from the samples that
    /// this frame may use.
    [[nodiscard]] std::vector<sim::WeightedImpulse> frame(double T, std::span<const Strike> strikes,
                                                          const ChokedBodies& choked);

private:
    struct Drawn {
        std::uint64_t id;
        sim::Impulse first;  ///< as first drawn
        double first_weight = 1;
        double final_weight = 0;  ///< of the released impulse, where it differs from the first
    };
    struct Mark {
        bool seen : 1 = false;   ///< drawn or settled, until cancelled and faded
        bool drawn : 1 = false;  ///< among drawn_
        bool folded : 1 = false, stopped : 1 = false;
    };
    Mark& mark(std::uint64_t id) {
        if (id > marks_.size()) marks_.resize(id);
        return marks_[id - 1];
    }
    [[nodiscard]] Mark mark_of(std::uint64_t id) const {
        return id > marks_.size() ? Mark{} : marks_[id - 1];
    }
    void start(double T, std::span<const Strike> strikes);

    std::vector<Drawn> drawn_;
    std::vector<Mark> marks_;  // of strike i + 1; those behind its end have none
    double last_s_ = 0;
    std::size_t first_open_ = 0;  // strikes before it are settled for good
};

/// The impulse of a strike on its body.
[[nodiscard]] sim::Impulse impulse_of(const Strike& strike);

/// Seconds of wall time in each part of the loop.
struct LoopTimes {
    double tracking = 0, simulation = 0, strikes = 0, waiting_for_frames = 0;
};

/// How a stick is drawn in a frame.
struct DrawnStick {
    tracking::PosePrediction pose;  ///< as drawn: held on a surface that it meets
    /// The tip that was predicted for the frame's time, before it is held: by the pictures' filter, or, where
    /// the frame holds the stick at a coming contact, by the sound's, which has predicted that contact.
    tracking::PointMotion tip;
    bool held = false;
};

/// What a frame shows.
struct FrameContents {
    std::vector<std::optional<DrawnStick>> sticks;  ///< none before its first sample
    std::vector<sim::ModalState> bodies;            ///< empty: at rest

    [[nodiscard]] std::vector<std::optional<tracking::PosePrediction>> poses() const {
        std::vector<std::optional<tracking::PosePrediction>> all;
        for (const auto& stick : sticks) all.push_back(stick ? std::optional(stick->pose) : std::nullopt);
        return all;
    }
};

/// From what is known of the sticks to strikes, notes and pictures, on the clock of the caller:
/// contacts of predicted paths (sim), their life as strikes (StrikeScheduler), the bodies' response, and what
/// a frame shows of both. Begins with all bodies at rest. Offline and in real time the same.
class StrikePipeline {
public:
    /// A note's change, for the sound: the note as it stands, its id that of the strike; `scheduled` false:
    /// cancelled.
    using Notify = std::function<void(const audio::Note& note, bool scheduled)>;

    /// The strikes follow the margin and the cancelling of the options; t0_s is audio sample 0. `simulation`
    /// begins anew with the first step; `sticks` are kept up to date by the caller. `contacts`: a model whose
    /// network of contacts is heard (contact_model()); may be none.
    StrikePipeline(const Kit& kit, const PlayOptions& options, double t0_s, double tip_radius_m,
                   const std::vector<Stick>& sticks, sim::Simulation& simulation, Notify notify,
                   const std::shared_ptr<const tracking::PathModel>& contacts = {});

    /// Before the samples at s (StrikeScheduler::advance_to).
    void advance_to(double s, double fixed_s = -std::numeric_limits<double>::infinity());
    /// The filter of a stick has started anew.
    void restart(std::uint32_t stick);
    /// New samples of these sticks at s: contacts, strikes, notes.
    void take(double s, std::span<const std::uint32_t> moved);
    /// Tips that choke what they lie on, found since the last call, in order; what rings ends a release margin
    /// after the sample.
    [[nodiscard]] std::vector<TipRest> take_tip_rests();
    /// What pedals and hands sound, known at s: what it chokes comes to rest.
    void choke(const audio::Note& note, double s = -std::numeric_limits<double>::infinity()) {
        choked_.take(note, s);
    }
    /// After the last sample.
    void finish();
    /// What the frame shown at T >= s shows, known at s. Frames come in order of T.
    [[nodiscard]] FrameContents scene(double s, double T);
    /// What a frame shows at some moments, in order, of which the last is when it is shown; it is as scene() has it. At
    /// a moment before s a body is as at s and a stick as in its newest sample.
    [[nodiscard]] std::vector<FrameContents> scenes(double s, std::span<const double> moments);

    [[nodiscard]] const std::vector<Strike>& strikes() const { return scheduler_.strikes(); }
    /// The caller adds the times of its own part.
    [[nodiscard]] LoopTimes& times() { return times_; }
    [[nodiscard]] const LoopTimes& times() const { return times_; }

private:
    [[nodiscard]] sim::StepReply step(sim::StepRequest& request);
    /// Where the paths of a stick stand in a request; each path's `stick` is its own place there, so that its
    /// contacts can be assigned to it.
    struct StickPaths {
        std::uint32_t stick = 0;
        std::size_t predicted = 0;            ///< the first of the models' paths, which follow each other
        std::size_t measured = 0;             ///< stands still: makes no contact but by starting inside
        std::optional<std::size_t> way = {};  ///< of the measured tip since the sample before
        std::optional<std::size_t> confirming = {};  ///< where a second filter confirms
        std::optional<std::size_t> network = {};     ///< what a network of contacts expects, if anything
        std::vector<std::optional<tracking::ContactTimes>> times =
            {};  ///< and when (ContactForecast::Forecast)
    };
    [[nodiscard]] std::vector<StickPaths> add_paths(std::span<const std::uint32_t> moved,
                                                    std::vector<sim::TipPath>& paths) const;
    /// What the network of contacts expects of a stick.
    [[nodiscard]] ContactForecast::Forecast forecast(const Stick& stick) const;
    /// Compares the sticks with those that the network was learned from.
    void follow_motion(std::span<const std::uint32_t> moved);
    void take_contacts(double s, const StickPaths& paths, const sim::StepReply& reply);
    [[nodiscard]] std::vector<double> measured_clearance(const StickPaths& paths,
                                                         const sim::StepReply& reply) const;
    void send_notes();
    void settle_impulses(double s, sim::StepRequest& request);
    [[nodiscard]] std::vector<const Strike*> recent(std::uint32_t stick, double s) const;
    [[nodiscard]] const Strike* struck_by(std::uint32_t stick, double s, double T) const;
    /// `shows`: by this the frame has shown the strike that holds the stick.
    [[nodiscard]] DrawnStick drawn(std::uint32_t stick, double s, double T, bool shows);

    const Kit& kit_;
    bool cancelling_;
    double release_margin_s_, tip_radius_m_;
    const std::vector<Stick>& sticks_;
    sim::Simulation& simulation_;
    Notify notify_;
    std::optional<ContactForecast> network_;
    std::vector<tracking::KnownMotion> motions_;  // of each stick, where there is a network
    StrikeScheduler scheduler_;
    TipRests rests_;
    std::vector<StrikeDecision> decisions_;  // of each stick, of each model
    ChokedBodies choked_;
    DrawnStrikes drawn_;
    std::vector<std::uint64_t> unfolded_;  // released strikes whose impulses lie ahead
    std::set<std::uint64_t> touching_;     // recent strikes that a frame has shown the stick at
    bool begun_ = false;
    double simulated_s_ = 0;
    LoopTimes times_;
};

}  // namespace app
