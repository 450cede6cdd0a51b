#include "stick_tracker.h"

#include <algorithm>

#include "predictors.h"

namespace app {
namespace {

// Cubic Hermite pieces of 8.3 ms: exact for the filters' parabolas; for a stick turning at 20 rad/s within 1
// um.
constexpr int kPathPieces = 8;
constexpr double kLongestPredictionS = 0.15;
constexpr int kPicturePieces = 9;  // frames ask any lead up to that; external predictors answer each 1/60 s
constexpr double kStandstillS = 1e-6;
constexpr double kImpossibleSpeed_mps = 1e4, kImpossibleDistanceM = 1e4;

// What `auto` stands for, as measured on recorded mallets and sabers (README, figures). Pictures want the
// least mean error: a velocity that fades with the lead errs 5 to 25 % less than one that lasts, on every
// recording. Strikes want a path that bends: constant acceleration times them best, and the constant
// velocity, which does not overshoot after a rebound, confirms them.
constexpr const char* kAutoPicture = "cv:q=1e7,decay=8,r=0.5,gate=5";
constexpr const char* kAutoSound = "ca:q=7e8,gate=5";
constexpr const char* kAutoConfirming = "cv:q=1e8,gate=5";

constexpr double kNearS = 0.05;   // a contact that near must be borne out
constexpr double kLaterS = 0.05;  // constant velocity meets the surface later than a stroke that accelerates

/// 0 to lead in equal pieces.
std::vector<double> leads_up_to(double lead_s, int pieces) {
    std::vector<double> leads;
    for (int i = 0; i <= pieces; ++i) leads.push_back(lead_s * i / pieces);
    return leads;
}

}  // namespace

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

void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> borne_out, double s) {
    std::erase_if(contacts, [&](const sim::Contact& contact) {
        if (contact.t_s - s > kNearS) return false;
        return std::none_of(borne_out.begin(), borne_out.end(), [&](const sim::Contact& other) {
            return other.body == contact.body && other.t_s <= contact.t_s + kLaterS;
        });
    });
}

std::string confirming_specification(const std::string& specification) {
    return specification == "auto" ? kAutoConfirming : "";
}

std::string picture_specification(const std::string& specification) {
    return specification == "auto" ? kAutoPicture : specification;
}

std::string sound_specification(const std::string& specification) {
    return specification == "auto" ? kAutoSound : specification;
}

StickTracker::StickTracker(std::uint32_t stick, const std::string& name, const StickGeometry& geometry,
                           const std::string& picture_predictor, const std::string& sound_predictor,
                           double sound_lead_s)
    : stick_(stick),
      geometry_(geometry),
      sound_leads_s_(path_leads(sound_lead_s)),
      picture_(make_any_predictor(picture_specification(picture_predictor),
                                  leads_up_to(kLongestPredictionS, kPicturePieces), name)),
      sound_(make_any_predictor(sound_specification(sound_predictor), sound_leads_s_, name)) {
    if (const std::string confirming = confirming_specification(sound_predictor); !confirming.empty())
        confirming_ = make_any_predictor(confirming, path_leads(kConfirmingLeadS), name);
}

tracking::SampleStatus StickTracker::correct(const tracking::PoseSample& sample) {
    (void)picture_->correct(sample);
    if (confirming_) (void)confirming_->correct(sample);
    const tracking::SampleStatus status = sound_->correct(sample);
    require_working(*picture_);
    require_working(*sound_);
    if (status == tracking::SampleStatus::accepted || status == tracking::SampleStatus::reinitialised) {
        measured_tip_ = sample.position + sample.orientation * geometry_.tip;
        started_ = true;
    }
    return status;
}

tracking::PosePrediction StickTracker::pose_at(double T) const {
    return picture_->predict(std::clamp(T - picture_->time_s(), 0.0, kLongestPredictionS));
}

sim::TipPath StickTracker::predicted_path() const {
    const auto pose = [this](double lead) { return sound_->predict(lead); };
    return app::predicted_path(pose, sound_->time_s(), geometry_, stick_, sound_leads_s_)
        .value_or(measured_path());
}

std::optional<sim::TipPath> StickTracker::confirming_path() const {
    if (!confirming_) return std::nullopt;
    const auto pose = [this](double lead) { return confirming_->predict(lead); };
    return app::predicted_path(pose, confirming_->time_s(), geometry_, stick_, path_leads(kConfirmingLeadS))
        .value_or(measured_path());
}

sim::TipPath StickTracker::measured_path() const {
    sim::TipPath path;
    path.stick = stick_;
    path.tip_radius_m = geometry_.radius_m;
    const double t = sound_->time_s();
    path.nodes = {{t, measured_tip_, Eigen::Vector3d::Zero()},
                  {t + kStandstillS, measured_tip_, Eigen::Vector3d::Zero()}};
    return path;
}

}  // namespace app
