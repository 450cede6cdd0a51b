#pragma once
#include <sim/simulation.h>
#include <tracking/contact_times.h>
#include <tracking/experience.h>
#include <tracking/predictor.h>
#include <tracking/stick_state.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kit/kit.h"
#include "sticks/predictors.h"

namespace app {

/// Specifications of a stick's predictors.
struct StickPredictors {
    std::string picture, sound;
    std::string confirming;          ///< confirms the strikes that `sound` predicts; empty: none
    double sound_lead_s = 1.0 / 15;  ///< how far ahead contacts are looked for
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();  ///< of the sticks (StickGeometry)
};

/// With `auto` resolved. Starts nothing.
[[nodiscard]] StickPredictors stick_predictors(const std::string& picture, const std::string& sound,
                                               double sound_lead_s,
                                               const Eigen::Vector3d& shaft = -Eigen::Vector3d::UnitZ());

/// One stick's filters, which get the same samples. Their state is a StickState, offline and in real time.
/// One thread at a time.
class StickFilters {
public:
    /// `stick` is the name that external predictors get. Throws BadInput for predictors that do not
    /// exist, std::runtime_error for an external one that does not start.
    StickFilters(const StickPredictors& predictors, const std::string& stick);

    /// Takes the next sample and writes the filters' predictions into `state`. Returns the status of the
    /// sound's filter; the times and counts of the state are that filter's. Throws std::runtime_error when an
    /// external predictor has failed.
    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample,
                                                 tracking::StickState& state);
    /// As before the first sample: times may begin again. Only experience() stays.
    void begin_anew();
    /// What the network of the pictures' predictor has learned from the stick since the StickFilters were
    /// made, begin_anew() included; none if it does not learn.
    [[nodiscard]] std::optional<tracking::Experience> experience() const;

private:
    void write_paths(tracking::StickState& state) const;

    /// A predictor, and its maker, which can make it anew.
    struct Filter {
        Filter(const std::string& specification, std::span<const double> leads_s, const TrackedStick& stick)
            : maker(specification), predictor(maker.make(leads_s, stick)) {}
        void begin_anew(const TrackedStick& stick);

        PredictorMaker maker;
        std::unique_ptr<tracking::Predictor> predictor;
    };

    TrackedStick stick_;
    double sound_lead_s_;
    Filter picture_, sound_;
    std::optional<Filter> confirming_;
    std::optional<tracking::Experience> earlier_;  // before begin_anew()
};

/// 0 to lead in eight equal pieces: the nodes of a predicted path.
[[nodiscard]] std::vector<double> path_leads(double lead_s);
/// 0 to lead in equal pieces.
[[nodiscard]] std::vector<double> leads_up_to(double lead_s, std::size_t pieces);

/// The path of the tip at those leads after the newest sample, of time `time_s`. `pose_after`: the predicted
/// pose by lead. None if it moves as no stick can (samples that jump within microseconds): such a path makes
/// no contact.
[[nodiscard]] std::optional<sim::TipPath> predicted_path(
    const std::function<tracking::PosePrediction(double)>& pose_after, double time_s,
    const StickGeometry& geometry, std::uint32_t stick, std::span<const double> leads_s);

/// Removes those of `contacts`, predicted at s, that are less than 50 ms ahead and not confirmed: a contact is
/// confirmed by one of `confirming`, the contacts of the second filter's path, with the same body at most 50 ms
/// later.
void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> confirming, double s);

/// The straight way of a tip from one sample to the next, `interval_s` later, moved in time so that it begins
/// at the later sample's time `t_s`: a simulation that has reached t_s cannot sweep an earlier path.
[[nodiscard]] sim::TipPath measured_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double t_s,
                                        double interval_s, double tip_radius_m);

/// Of `contacts`, those that a measured way of `interval_s` makes, the ones with bodies that the tip went right through:
/// in at a place that sounds, and out again by the newest sample, as its clearances `measured_m` say. Their times are
/// those at which the tip was there.
[[nodiscard]] std::vector<sim::Contact> passed_through(std::vector<sim::Contact> contacts, double interval_s,
                                                       std::span<const double> measured_m);

/// Pieces of a predicted path, cubic Hermite ones of 8.3 ms: exact for the filters' parabolas; for a stick that
/// turns at 20 rad/s within 1 um.
inline constexpr std::size_t kPathPieces = 8;
/// How far beyond the newest sample a pose is predicted; later it is held [s].
inline constexpr double kLongestPredictionS = 0.15;
/// How far ahead the confirming path reaches [s].
inline constexpr double kConfirmingLeadS = 0.1;

/// One stick after its newest sample, and its predicted motion, from the StickState that its filters
/// published, in this process or another.
class Stick {
public:
    /// `sound_lead_s`: how far ahead predicted_path() reaches.
    Stick(std::uint32_t index, const StickGeometry& geometry, double sound_lead_s)
        : index_(index),
          geometry_(geometry),
          sound_lead_s_(sound_lead_s),
          history_(geometry.shaft, geometry.tip) {}

    void take(const tracking::StickState& state);
    /// As before the first sample.
    void forget() { state_ = {}; }
    void set_geometry(const StickGeometry& geometry) {
        geometry_ = geometry;
        history_ = tracking::TipHistory(geometry.shaft, geometry.tip);
    }
    void set_sound_lead(double lead_s) { sound_lead_s_ = lead_s; }

    [[nodiscard]] const tracking::StickState& state() const { return state_; }
    [[nodiscard]] const StickGeometry& geometry() const { return geometry_; }
    /// False before the first sample.
    [[nodiscard]] bool started() const { return state_.samples > 0; }
    /// Between the last two samples seen [s]; 0: not known.
    [[nodiscard]] double interval_s() const { return interval_s_; }
    /// Centre of the tip in the newest sample that the sound's filter took [m].
    [[nodiscard]] const Eigen::Vector3d& measured_tip() const { return measured_tip_; }

    /// Pose for a picture shown at T >= the newest sample's time; a prediction is carried at most 0.15 s
    /// beyond that, then held.
    [[nodiscard]] tracking::PosePrediction pose_at(double T) const;
    /// The tip by the sound's filter at T, carried likewise.
    [[nodiscard]] tracking::PointMotion sounding_tip_at(double T) const;
    /// The path that a model of the sound's filter predicts over [0, sound lead] from its newest sample, and
    /// the measured tip as a path that stands still.
    [[nodiscard]] sim::TipPath predicted_path(std::size_t model) const;
    /// The path of the confirming filter, where there is one.
    [[nodiscard]] std::optional<sim::TipPath> confirming_path() const;
    /// The network's inputs from the samples that take() was given; false where there are too few.
    [[nodiscard]] bool look(tracking::TipView& view) const { return history_.look(view); }
    [[nodiscard]] double sound_lead_s() const { return sound_lead_s_; }
    [[nodiscard]] sim::TipPath measured_path() const;
    /// The measured tip's way since the sample before; none at a start.
    [[nodiscard]] std::optional<sim::TipPath> way() const;

private:
    std::uint32_t index_;
    StickGeometry geometry_;
    double sound_lead_s_, interval_s_ = 0;
    tracking::StickState state_;
    tracking::TipHistory history_;
    Eigen::Vector3d measured_tip_ = Eigen::Vector3d::Zero(), tip_before_ = Eigen::Vector3d::Zero();
};

}  // namespace app
