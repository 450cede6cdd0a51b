#pragma once
#include <tracking/stick_state.h>

#include "sticks/stick_outlook.h"

namespace app {

/// A stick as its sensor process last published it.
class StateStick final : public StickOutlook {
public:
    /// `confirms`: the sensor process runs a filter that confirms strikes.
    StateStick(std::uint32_t stick, const StickGeometry& geometry, bool confirms, double sound_lead_s)
        : StickOutlook(stick, geometry), confirms_(confirms), sound_lead_s_(sound_lead_s) {}

    void take(const tracking::StickState& state) {
        interval_s_ = started() && state.t_s > state_.t_s ? state.t_s - state_.t_s : 0;
        state_ = state;
        measured_tip_ = state.position + state.orientation * geometry().tip;
    }
    /// As before the first sample.
    void forget() { state_ = {}; }
    void set_sound_lead(double lead_s) { sound_lead_s_ = lead_s; }
    [[nodiscard]] const tracking::StickState& state() const { return state_; }
    /// Between the last two samples seen [s]; 0: not known.
    [[nodiscard]] double interval_s() const { return interval_s_; }

    [[nodiscard]] bool started() const override { return state_.samples > 0; }
    [[nodiscard]] const Eigen::Vector3d& measured_tip() const override { return measured_tip_; }
    [[nodiscard]] bool confirms() const override { return confirms_; }
    [[nodiscard]] std::size_t selected_model() const override { return state_.model; }
    [[nodiscard]] double sound_lead_s() const override { return sound_lead_s_; }

private:
    [[nodiscard]] double picture_time_s() const override { return state_.picture_t_s; }
    [[nodiscard]] double sound_time_s() const override { return state_.t_s; }
    [[nodiscard]] double confirming_time_s() const override { return state_.confirming_t_s; }
    [[nodiscard]] tracking::PosePrediction picture_pose(double lead_s) const override {
        return state_.picture.after(lead_s);
    }
    [[nodiscard]] tracking::PosePrediction sound_pose(double lead_s) const override {
        return state_.sound.after(lead_s);
    }
    [[nodiscard]] tracking::PosePrediction confirming_pose(double lead_s) const override {
        return state_.confirming.after(lead_s);
    }

    bool confirms_;
    double sound_lead_s_, interval_s_ = 0;
    tracking::StickState state_;
    Eigen::Vector3d measured_tip_ = Eigen::Vector3d::Zero();
};

}  // namespace app
