#include "sticks/stick_outlook.h"

#include <algorithm>

namespace app {
namespace {

// Cubic Hermite pieces of 8.3 ms: exact for the filters' parabolas; for a stick turning at 20 rad/s within 1
// um.
constexpr int kPathPieces = 8;
constexpr double kStandstillS = 1e-6;
constexpr double kImpossibleSpeed_mps = 1e4, kImpossibleDistanceM = 1e4;

}  // namespace

std::vector<double> leads_up_to(double lead_s, int pieces) {
    std::vector<double> leads;
    for (int i = 0; i <= pieces; ++i) leads.push_back(lead_s * i / pieces);
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

tracking::PosePrediction StickOutlook::pose_at(double T) const {
    return picture_pose(std::clamp(T - picture_time_s(), 0.0, kLongestPredictionS));
}

tracking::PointMotion StickOutlook::sounding_tip_at(double T) const {
    return tracking::point_of(sound_pose(std::clamp(T - sound_time_s(), 0.0, kLongestPredictionS)),
                              geometry_.tip);
}

sim::TipPath StickOutlook::predicted_path() const {
    const auto pose = [this](double lead) { return sound_pose(lead); };
    return app::predicted_path(pose, sound_time_s(), geometry_, stick_, path_leads(sound_lead_s()))
        .value_or(measured_path());
}

std::optional<sim::TipPath> StickOutlook::confirming_path() const {
    if (!confirms()) return std::nullopt;
    const auto pose = [this](double lead) { return confirming_pose(lead); };
    return app::predicted_path(pose, confirming_time_s(), geometry_, stick_, path_leads(kConfirmingLeadS))
        .value_or(measured_path());
}

sim::TipPath StickOutlook::measured_path() const {
    sim::TipPath path;
    path.stick = stick_;
    path.tip_radius_m = geometry_.radius_m;
    const double t = sound_time_s();
    path.nodes = {{t, measured_tip(), Eigen::Vector3d::Zero()},
                  {t + kStandstillS, measured_tip(), Eigen::Vector3d::Zero()}};
    return path;
}

}  // namespace app
