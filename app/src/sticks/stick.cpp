#include "sticks/stick.h"

#include <algorithm>

namespace app {
namespace {

constexpr double kNearS = 0.05;   // a contact nearer than this must be confirmed
constexpr double kLaterS = 0.05;  // constant velocity meets the surface later than a stroke that accelerates
constexpr double kStandstillS = 1e-6;
constexpr double kImpossibleSpeed_mps = 1e4, kImpossibleDistanceM = 1e4;

}  // namespace

std::vector<double> leads_up_to(double lead_s, std::size_t pieces) {
    std::vector<double> leads;
    for (std::size_t i = 0; i <= pieces; ++i)
        leads.push_back(lead_s * static_cast<double>(i) / static_cast<double>(pieces));
    return leads;
}

std::vector<double> path_leads(double lead_s) {
    return leads_up_to(lead_s, kPathPieces);
}

std::optional<sim::TipPath> predicted_path(const std::function<tracking::PosePrediction(double)>& pose_after,
                                           double time_s, const StickGeometry& geometry, std::uint32_t stick,
                                           std::span<const double> leads_s) {
    sim::TipPath path;
    path.stick = stick;
    path.tip_radius_m = geometry.radius_m;
    for (const double h : leads_s) {
        const tracking::PointMotion tip = tracking::point_of(pose_after(h), geometry.tip);
        path.nodes.push_back({time_s + h, tip.position, tip.velocity});
        if (!(tip.velocity.norm() < kImpossibleSpeed_mps) || !(tip.position.norm() < kImpossibleDistanceM))
            return std::nullopt;
    }
    return path;
}

void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> confirming, double s) {
    std::erase_if(contacts, [&](const sim::Contact& contact) {
        if (contact.t_s - s > kNearS) return false;
        return std::none_of(confirming.begin(), confirming.end(), [&](const sim::Contact& other) {
            return other.body == contact.body && other.t_s <= contact.t_s + kLaterS;
        });
    });
}

void Stick::take(const tracking::StickState& state) {
    interval_s_ = started() && state.t_s > state_.t_s ? state.t_s - state_.t_s : 0;
    state_ = state;
    measured_tip_ = state.position + state.orientation * geometry_.tip;
}

tracking::PosePrediction Stick::pose_at(double T) const {
    return state_.picture.after(std::clamp(T - state_.picture_t_s, 0.0, kLongestPredictionS));
}

tracking::PointMotion Stick::sounding_tip_at(double T) const {
    return tracking::point_of(state_.sound.after(std::clamp(T - state_.t_s, 0.0, kLongestPredictionS)),
                              geometry_.tip);
}

sim::TipPath Stick::predicted_path(std::size_t model) const {
    const auto pose = [&](double lead) {
        return state_.models > 1 ? state_.sound_models[model].after(lead) : state_.sound.after(lead);
    };
    return app::predicted_path(pose, state_.t_s, geometry_, index_, path_leads(sound_lead_s_))
        .value_or(measured_path());
}

std::optional<sim::TipPath> Stick::confirming_path() const {
    if (state_.confirms == 0) return std::nullopt;
    const auto pose = [this](double lead) { return state_.confirming.after(lead); };
    return app::predicted_path(pose, state_.confirming_t_s, geometry_, index_, path_leads(kConfirmingLeadS))
        .value_or(measured_path());
}

sim::TipPath Stick::measured_path() const {
    sim::TipPath path;
    path.stick = index_;
    path.tip_radius_m = geometry_.radius_m;
    path.nodes = {{state_.t_s, measured_tip_, Eigen::Vector3d::Zero()},
                  {state_.t_s + kStandstillS, measured_tip_, Eigen::Vector3d::Zero()}};
    return path;
}

}  // namespace app
