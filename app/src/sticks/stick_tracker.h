#pragma once
#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sticks/stick_outlook.h"

namespace app {

/// One stick's filters in this process: one predictor for pictures, one for sound, fed the same samples.
class StickTracker final : public StickOutlook {
public:
    /// `name` is what external predictors are told; `sound_lead_s` the lead of every predicted_path().
    StickTracker(std::uint32_t stick, const std::string& name, const StickGeometry& geometry,
                 const std::string& picture_predictor, const std::string& sound_predictor,
                 double sound_lead_s);

    /// What the sound's filter made of the sample; refused samples change nothing. Throws
    /// std::runtime_error when an external predictor has failed.
    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample);

    [[nodiscard]] bool started() const override { return started_; }
    [[nodiscard]] const Eigen::Vector3d& measured_tip() const override { return measured_tip_; }
    [[nodiscard]] bool confirms() const override { return confirming_ != nullptr; }
    [[nodiscard]] std::size_t selected_model() const override { return sound_->selected(); }
    [[nodiscard]] double sound_lead_s() const override { return sound_lead_s_; }

private:
    [[nodiscard]] double picture_time_s() const override { return picture_->time_s(); }
    [[nodiscard]] double sound_time_s() const override { return sound_->time_s(); }
    [[nodiscard]] double confirming_time_s() const override { return confirming_->time_s(); }
    [[nodiscard]] tracking::PosePrediction picture_pose(double lead_s) const override {
        return picture_->predict(lead_s);
    }
    [[nodiscard]] tracking::PosePrediction sound_pose(double lead_s) const override {
        return sound_->predict(lead_s);
    }
    [[nodiscard]] tracking::PosePrediction confirming_pose(double lead_s) const override {
        return confirming_->predict(lead_s);
    }

    double sound_lead_s_;
    std::unique_ptr<tracking::Predictor> picture_, sound_, confirming_;  // confirming_ may be none
    Eigen::Vector3d measured_tip_ = Eigen::Vector3d::Zero();
    bool started_ = false;
};

}  // namespace app
