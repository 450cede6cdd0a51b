#pragma once
#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <memory>
#include <string>
#include <vector>

#include "tip_track.h"

namespace app {

/// A predictor's specification with `auto` resolved: what measurements chose for pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);

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
    [[nodiscard]] sim::TipPath measured_path() const;

private:
    std::uint32_t stick_;
    StickGeometry geometry_;
    std::vector<double> sound_leads_s_;  // of the nodes of predicted_path()
    std::unique_ptr<tracking::Predictor> picture_, sound_;
    Eigen::Vector3d measured_tip_ = Eigen::Vector3d::Zero();
    bool started_ = false;
};

}  // namespace app
