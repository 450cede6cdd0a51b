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

/// What is expected of a stick after a sample.
struct ExpectedStrikes {
    double s = 0, interval_s = 0;  ///< of the sample; until the next one
    /// [m] signed, from each surface: of the tip as measured, and as the sound's filter has it.
    std::span<const double> measured_m, filtered_m = {};
    std::vector<sim::Contact> passed =
        {};  ///< of bodies that the tip went right through since the sample before
    /// Contacts of the path of the sound's predictor, and those of them that a second filter confirms (all, where there
    /// is none). By time.
    std::vector<sim::Contact> path = {}, confirmed = {};
    std::vector<sim::Contact> network =
        {};  ///< of the path that a network of contacts expects (ContactForecast)
    /// By surface, what that network says of the time to it; empty without a network.
    std::span<const std::optional<tracking::ContactTimes>> times = {};
    bool known =
        false;  ///< the stick moves as those that the network was learned from (tracking::KnownMotion)
};

/// Contacts that are kept in mind, and those that sound.
struct DecidedStrikes {
    std::vector<sim::Contact> kept, sounding;
    /// [s] By surface: a note that is fixed before the next sample, and whose onset lies before this, is cancelled.
    std::vector<double> silent_until_s;
};

/// Whether a stick's notes are to sound, and when. Two say when it will strike: the path of the sound's predictor, and,
/// with a model that has one, the network of contacts. Each is heard by what it turned out to be worth:
///
/// - A missed strike costs 1, a false sound `false_cost`: a note sounds where false_cost (1 - P) < P, with P the share
///   that came of the last 20 strikes expected by the same: by the path alone, by the network alone, or by both;
///   together with 20 strikes of which 0.95 came, for the network alone with 4 of which 0.05 came, or, where the motion is
///   known (tracking::KnownMotion), 0.8. So what the path expects falls silent, at a cost of 1, only where hardly
///   anything comes of it. The question is put at the last sample before the note is fixed, as until then it costs
///   nothing to wait; to the network alone at each sample. A strike that fell silent and comes all the same sounds late:
///   what the path still expects when the tip is seen in the surface is not asked about.
/// - Where the motion is known, the network is a second witness of each note: with p its probability of a contact up to
///   30 ms after the note and P0 = 0.95 (0.8 for what it alone expects) before it was asked, the note sounds where
///     false_cost (1 - P0) (1 - p) < P0 p.
///   P0 stays as it is: what came of other strikes, p tells apart from this one.
/// - A strike's time and speed are the network's where its errors of time have turned out smaller: by their sum over all
///   samples at which both expected the strike, each weighing 0.98 of the next, and 10 ms at first, which are the
///   network's, or, where the motion is known, the path's. So one begins with the path unless the motion is known.
///
/// A strike came if the measured tip entered the surface, 3 mm deep, or passed right through it between two samples, within
/// 30 ms of when it was expected.
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
    /// What was expected of a surface, until it is known what came.
    struct Forecast {
        std::size_t surface = 0;
        Kind kind = both;
        std::optional<double> path_s = {}, network_s = {};  ///< when
        bool counts = false;                                ///< in the share of its kind
        bool came = false;
    };

    void observe(const ExpectedStrikes& expected);
    void strike(std::size_t surface, double t_s);
    void settle(double s);
    void decide(std::size_t surface, const ExpectedStrikes& expected, DecidedStrikes& decided);

    /// Of the strikes that were expected, how many came.
    struct Share {
        double came = 0, of = 0;  ///< of the last ones
        void add(bool it_came);
    };
    [[nodiscard]] static double prior(Kind kind, bool known);
    [[nodiscard]] double probability(Kind kind, bool known) const;
    /// Notes of a surface that is struck, as `kind` expects, are silent before this.
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
