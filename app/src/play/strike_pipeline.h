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
#include "process/clock.h"
#include "sticks/stick.h"
#include "strikes/contact_forecast.h"
#include "strikes/strike.h"
#include "strikes/strike_decision.h"
#include "strikes/strike_scheduler.h"
#include "strikes/tip_rests.h"

namespace app {

/// The response of the bodies to strikes, as pictures show it. The first frame after a contact draws it, with
/// the impulse known then. If the strike is cancelled later, its response fades within 100 ms. If it moves
/// before its release, the response passes over to the final one in the same time. So there is never a jump.
/// Choked impulses are weighted by ChokedBodies. Frames must come in order. One thread.
class DrawnStrikes {
public:
    /// A released strike's impulse has become part of the bodies' exact states.
    void folded(std::uint64_t id) { mark(id).folded = true; }
    /// Its impulse was choked and taken out of these states again.
    void stopped(std::uint64_t id) { mark(id).stopped = true; }
    /// The impulses that the frame shown at T adds to the exact states. `strikes`: as known from the samples
    /// that this frame may use.
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

struct PipelineSettings {
    double t0_s;          ///< time of audio sample 0
    double tip_radius_m;  ///< of the sticks
    double render_lead_s;
    double release_margin_s;  ///< a note is fixed this long before its onset
    double false_cost;        ///< of a false sound; that of a missed strike is 1 (StrikeDecision)
    bool cancelling;          ///< false: every note that was scheduled is played
};

/// Turns predicted stick motion into strikes, notes and pictures, on the clock of the caller: contacts of
/// predicted paths (sim), their life as strikes (StrikeScheduler), the bodies' response, and the contents of
/// frames. Begins with all bodies at rest. The same offline and in real time.
class StrikePipeline {
public:
    /// Gets a note that was scheduled or changed, or, with `scheduled` false, cancelled. Its id is that of
    /// the strike.
    using Notify = std::function<void(const audio::Note& note, bool scheduled)>;

    /// `simulation` begins anew with the first step. The caller keeps `sticks` up to date. `contacts`: a
    /// model whose network of contacts takes part in decisions (contact_model()); null: none.
    StrikePipeline(const Kit& kit, const PipelineSettings& settings, const std::vector<Stick>& sticks,
                   sim::Simulation& simulation, Notify notify,
                   const std::shared_ptr<const tracking::PathModel>& contacts = {});

    /// Before the samples at s (StrikeScheduler::advance_to).
    void advance_to(double s, double fixed_s = -std::numeric_limits<double>::infinity());
    /// The filter of a stick has started anew.
    void restart(std::uint32_t stick);
    /// New samples of these sticks at s: contacts, strikes, notes.
    void take(double s, std::span<const std::uint32_t> moved);
    /// The tips that choke an instrument, found since the last call, in order. The sound ends a release
    /// margin after the sample.
    [[nodiscard]] std::vector<TipRest> take_tip_rests();
    /// Takes a note of a pedal or a hand, known at s: the bodies that it chokes come to rest.
    void choke(const audio::Note& note, double s = -std::numeric_limits<double>::infinity()) {
        choked_.take(note, s);
    }
    /// After the last sample.
    void finish();
    /// The contents of the frame shown at T >= s, as known at s. Frames come in order of T.
    [[nodiscard]] FrameContents scene(double s, double T);
    /// The contents of a frame at several moments, in order, for motion blur. The last moment is when the
    /// frame is shown, with the contents of scene(). At a moment before s bodies are as at s, and sticks as
    /// in their newest samples.
    [[nodiscard]] std::vector<FrameContents> scenes(double s, std::span<const double> moments);

    [[nodiscard]] const std::vector<Strike>& strikes() const { return scheduler_.strikes(); }
    /// The caller adds the times of its own part.
    [[nodiscard]] LoopTimes& times() { return times_; }
    [[nodiscard]] const LoopTimes& times() const { return times_; }

private:
    [[nodiscard]] sim::StepReply step(sim::StepRequest& request);
    /// Indices of a stick's paths in a request. sim::TipPath::stick holds the path's own index, so that
    /// contacts can be assigned to paths.
    struct StickPaths {
        std::uint32_t stick = 0;
        std::size_t predicted = 0;            ///< of the models' paths the first; the others follow
        std::size_t measured = 0;             ///< stands still: makes a contact only if it starts inside
        std::optional<std::size_t> way = {};  ///< of the measured tip since the sample before
        std::optional<std::size_t> confirming = {};  ///< of the confirming filter, if there is one
        std::optional<std::size_t> network = {};     ///< predicted by a network of contacts, if there is one
        std::vector<std::optional<tracking::ContactTimes>> times = {};  ///< ContactForecast::Forecast::times
    };
    [[nodiscard]] std::vector<StickPaths> add_paths(std::span<const std::uint32_t> moved,
                                                    std::vector<sim::TipPath>& paths) const;
    /// The forecast of the network of contacts for a stick.
    [[nodiscard]] ContactForecast::Forecast forecast(const Stick& stick) const;
    /// Follows whether the sticks move as those that the network was trained on (tracking::KnownMotion).
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
    PipelineSettings settings_;
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
    std::set<std::uint64_t> touching_;     // recent strikes at which a frame has drawn the stick
    bool begun_ = false;
    double simulated_s_ = 0;
    LoopTimes times_;
};

}  // namespace app
