#pragma once
#include <sim/simulation.h>
#include <tracking/contact_times.h>

#include <array>
#include <cstddef>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace app {

/// What is known and predicted of a stick after a sample.
struct ExpectedStrikes {
    double s = 0, interval_s = 0;  ///< time of the sample; expected time to the next one
    /// Signed distances [m] from each surface, of the measured tip and of the filtered one.
    std::span<const double> measured_m, filtered_m = {};
    std::vector<sim::Contact> passed =
        {};  ///< of bodies that the tip went right through since the sample before
    /// Contacts of the path of the sound's predictor, and those of them that the confirming filter confirms
    /// (all, without such a filter). By time.
    std::vector<sim::Contact> path = {}, confirmed = {};
    std::vector<sim::Contact> network =
        {};  ///< of the path that a network of contacts predicts (ContactForecast)
    /// By surface, that network's distribution of the time to contact; empty without a network.
    std::span<const std::optional<tracking::ContactTimes>> times = {};
    bool known = false;  ///< the stick moves as those that the network was trained on (tracking::KnownMotion)
};

/// The contacts that are tracked, and those of them that are to sound.
struct DecidedStrikes {
    std::vector<sim::Contact> kept, sounding;
    /// By surface [s]: a note that will be fixed before the next sample, with an onset before this, is
    /// cancelled.
    std::vector<double> silent_until_s;
};

/// Decides which of a stick's predicted strikes sound, and when. There are two predictions: the path of the
/// sound's predictor, and, with a model that has one, the network of contacts. Each counts by how often it
/// was right:
///
/// - A missed strike costs 1, a false sound `false_cost`: a note sounds where false_cost (1 - P) < P. P is
///   the share of strikes that came true among the last 20 of the same kind: predicted by the path alone, by
///   the network alone, or by both. The prior of P is 20 strikes of which 95 % came true; for the network
///   alone 4 strikes of which 5 %, or, where the motion is known (tracking::KnownMotion), 80 % came true. So
///   at a cost of 1 strikes of the path are silenced only where hardly any comes true. The decision is made
///   at the last sample before the note is fixed, since waiting until then costs nothing; for strikes of the
///   network alone it is made at each sample. A strike that was silenced and comes true sounds late: one that
///   the path still predicts when the measured tip is in the surface always sounds.
/// - Where the motion is known, the network decides about each note, too. With p its probability of a contact
///   up to 30 ms after the note, and the prior P0 = 0.95 (0.8 for strikes of the network alone), the note
///   sounds where
///     false_cost (1 - P0) (1 - p) < P0 p.
///   P0 does not follow earlier strikes, because p already tells this strike from them.
/// - A strike's time and speed are those of the prediction with the smaller errors of time: the sum over all
///   samples at which both predicted the strike, each sample weighing 0.98 of the next. The sum of the
///   network begins with 10 ms, or, where the motion is known, that of the path. So one begins with the path
///   unless the motion is known.
///
/// A strike came true if, within 30 ms of its predicted time, the measured tip entered the surface, 3 mm
/// deep, or passed right through it between two samples.
///
/// One stick (and model of a predictor with several). One thread. Deterministic.
class StrikeDecision {
public:
    /// Notes are fixed `margin_s` before their onset.
    StrikeDecision(std::size_t surfaces, double false_cost, double margin_s)
        : false_cost_(false_cost), margin_s_(margin_s), surfaces_(surfaces) {}

    /// The stick's samples begin anew, as after a gap. What was learned stays.
    void restart();
    [[nodiscard]] DecidedStrikes after(const ExpectedStrikes& expected);

private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    /// The measured tip and one surface.
    struct Surface {
        bool known = false, armed = false;
        double lowest_measured_m = kNever, lowest_filtered_m = kNever;  ///< since it was disarmed
        double last_m = 0;
        std::optional<double> entered_s = {};
    };
    enum Kind : std::size_t { path_alone, network_alone, both };
    /// A predicted strike on a surface, until it is known whether it came true.
    struct Forecast {
        std::size_t surface = 0;
        Kind kind = both;
        std::optional<double> path_s = {}, network_s = {};  ///< predicted times
        bool counts = false;                                ///< in the Share of its kind
        bool came = false;
    };

    void observe(const ExpectedStrikes& expected);
    void strike(std::size_t surface, double t_s);
    void settle(double s);
    void decide(std::size_t surface, const ExpectedStrikes& expected, DecidedStrikes& decided);

    /// How many of the last predicted strikes came true.
    struct Share {
        double came = 0, of = 0;
        void add(bool it_came);
    };
    [[nodiscard]] static double prior(Kind kind, bool known);
    [[nodiscard]] double probability(Kind kind, bool known) const;
    /// DecidedStrikes::silent_until_s for a surface on which a strike of this kind is predicted.
    [[nodiscard]] double silent_until_s(std::size_t surface, Kind kind,
                                        const ExpectedStrikes& expected) const;

    double false_cost_, margin_s_;
    std::vector<Surface> surfaces_;
    double last_s_ = 0;
    std::deque<Forecast> forecasts_;
    std::array<Share, 3> shares_;  // by Kind
    double path_errors_s_ = 0, network_errors_s_ = 0, head_start_s_ = 0.01;
};

}  // namespace app
