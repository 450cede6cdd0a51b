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

// What `auto` stands for. Pictures want the least mean error, strikes a path that bends: constant velocity
// does the one, constant acceleration the other (an acceleration in the state costs 40 % and more of position
// error at 1/15 s on recorded strokes, and times contacts best).
constexpr const char* kAutoPicture = "cv:q=1e8,gate=5";
constexpr const char* kAutoSound = "ca:q=1e9,gate=5";

/// 0 to lead in equal pieces.
std::vector<double> leads_up_to(double lead_s, int pieces) {
    std::vector<double> leads;
    for (int i = 0; i <= pieces; ++i) leads.push_back(lead_s * i / pieces);
    return leads;
}

}  // namespace

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
      sound_leads_s_(leads_up_to(sound_lead_s, kPathPieces)),
      picture_(make_any_predictor(picture_specification(picture_predictor),
                                  leads_up_to(kLongestPredictionS, kPicturePieces), name)),
      sound_(make_any_predictor(sound_specification(sound_predictor), sound_leads_s_, name)) {}

tracking::SampleStatus StickTracker::correct(const tracking::PoseSample& sample) {
    (void)picture_->correct(sample);
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
    sim::TipPath path;
    path.stick = stick_;
    path.tip_radius_m = geometry_.radius_m;
    for (const double h : sound_leads_s_) {
        const tracking::PointMotion tip = tracking::point_of(sound_->predict(h), geometry_.tip);
        path.nodes.push_back({sound_->time_s() + h, tip.position, tip.velocity});
        // What no stick can do (samples that jump within microseconds) makes no contact.
        if (!(tip.velocity.norm() < kImpossibleSpeed_mps) || !(tip.position.norm() < kImpossibleDistanceM))
            return measured_path();
    }
    return path;
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
