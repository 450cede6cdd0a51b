#pragma once
#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tip_track.h"

namespace app {

/// A predictor's specification with `auto` resolved: what measurements chose for pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);

/// 0 to lead in eight equal pieces: the nodes of a predicted path.
[[nodiscard]] std::vector<double> path_leads(double lead_s);

/// The path of the tip at those leads from a newest sample at `time_s`, of a pose by lead. None if it moves
/// as no stick can (samples that jump within microseconds): such a path makes no contact.
[[nodiscard]] std::optional<sim::TipPath> predicted_path(
    const std::function<tracking::PosePrediction(double)>& pose_after, double time_s,
    const StickGeometry& geometry, std::uint32_t stick, std::span<const double> leads_s);

/// What confirms the strikes of a sound predictor's specification: empty for none. `auto` finds contacts with
/// one filter and believes them, when they are near, only if another bears them out (keep_confirmed).
[[nodiscard]] std::string confirming_specification(const std::string& sound_specification);
/// How far ahead the confirming path reaches [s].
inline constexpr double kConfirmingLeadS = 0.1;

/// Keeps of `contacts`, predicted at s, those that are not yet near (50 ms) and those that the confirming
/// predictor bears out: its path meets the same body too, at most 50 ms later.
void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> borne_out, double s);

/// One stick's filters: one predictor for pictures, one for sound, fed the same samples.
class StickTracker {
public:
    /// `name` is what external predictors are told; `sound_lead_s` the lead of every predicted_path().
    StickTracker(std::uint32_t stick, const std::string& name, const StickGeometry& geometry,
                 const std::string& picture_predictor, const std::string& sound_predictor,
                 double sound_lead_s);

    /// What the sound's filter made of the sample; refused samples change nothing. Throws
    /// std::runtime_error when an external predictor has failed.
    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample);
    [[nodiscard]] bool started() const { return started_; }
    /// Centre of the tip in the newest sample that the filter took [m].
    [[nodiscard]] const Eigen::Vector3d& measured_tip() const { return measured_tip_; }
    /// Pose for a picture shown at T >= the newest sample's time; a prediction is carried at most 0.15 s
    /// beyond that, then held.
    [[nodiscard]] tracking::PosePrediction pose_at(double T) const;
    /// The tip's centre in that pose.
    [[nodiscard]] Eigen::Vector3d tip_at(double T) const {
        return tracking::point_of(pose_at(T), geometry_.tip).position;
    }
    /// The path that the sound's filter predicts over [0, sound lead] from its newest sample, and the
    /// measured tip as a path that stands still.
    [[nodiscard]] sim::TipPath predicted_path() const;
    /// That of the filter which confirms strikes, where there is one.
    [[nodiscard]] std::optional<sim::TipPath> confirming_path() const;
    [[nodiscard]] bool confirms() const { return confirming_ != nullptr; }
    /// Which of its models the sound's filter has selected.
    [[nodiscard]] std::size_t selected_model() const { return sound_->selected(); }
    [[nodiscard]] sim::TipPath measured_path() const;

private:
    std::uint32_t stick_;
    StickGeometry geometry_;
    std::vector<double> sound_leads_s_;                                  // of the nodes of predicted_path()
    std::unique_ptr<tracking::Predictor> picture_, sound_, confirming_;  // confirming_ may be none
    Eigen::Vector3d measured_tip_ = Eigen::Vector3d::Zero();
    bool started_ = false;
};

}  // namespace app
