#include "sticks/stick.h"

#include <algorithm>
#include <cassert>

#include "sticks/external_predictor.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kNearS = 0.05;   // a contact nearer than this must be confirmed
constexpr double kLaterS = 0.05;  // constant velocity meets the surface later than a stroke that accelerates
constexpr double kStandstillS = 1e-6;
constexpr double kImpossibleSpeed_mps = 1e4, kImpossibleDistanceM = 1e4;

// Frames ask any lead up to the longest; an external predictor answers each 1/60 s.
constexpr std::size_t kPicturePieces = 9;

/// What the predictor expects: its motion; where it has none, its predictions at those leads.
tracking::PosePath path_of(const tracking::Predictor& predictor, double reach_s, std::size_t pieces) {
    if (const std::optional<tracking::Motion> motion = predictor.motion()) return *motion;
    tracking::SampledMotion path(reach_s, pieces);
    for (std::size_t i = 0; i <= pieces; ++i) path.set(i, predictor.predict(path.lead_s(i)));
    return path;
}

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

sim::TipPath measured_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double t_s,
                          double interval_s, double tip_radius_m) {
    const Eigen::Vector3d velocity = (to - from) / interval_s;
    return {0, tip_radius_m, {{t_s, from, velocity}, {t_s + interval_s, to, velocity}}};
}

std::vector<sim::Contact> passed_through(std::vector<sim::Contact> contacts, double interval_s,
                                         std::span<const double> measured_m) {
    std::erase_if(contacts, [&](const sim::Contact& contact) {
        return contact.starts_inside || contact.zone < 0 || measured_m[contact.body] <= 0;
    });
    for (sim::Contact& contact : contacts) contact.t_s -= interval_s;
    return contacts;
}

void Stick::take(const tracking::StickState& state) {
    const bool goes_on = started() && state.starts == state_.starts && state.t_s > state_.t_s;
    interval_s_ = goes_on ? state.t_s - state_.t_s : 0;
    tip_before_ = measured_tip_;
    if (state.samples > state_.samples) {
        if (!goes_on) history_.restart();
        history_.push({state.t_s, state.position, state.orientation, state.oriented != 0});
    }
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

std::optional<sim::TipPath> Stick::way() const {
    if (!(interval_s_ > 0)) return std::nullopt;
    return measured_way(tip_before_, measured_tip_, state_.t_s, interval_s_, geometry_.radius_m);
}

StickPredictors stick_predictors(const std::string& picture, const std::string& sound, double sound_lead_s,
                                 const Eigen::Vector3d& shaft) {
    return {picture_specification(picture), sound_specification(sound), confirming_specification(sound),
            sound_lead_s, shaft};
}

StickFilters::StickFilters(const StickPredictors& predictors, const std::string& stick)
    : stick_{stick, predictors.shaft},
      sound_lead_s_(predictors.sound_lead_s),
      picture_(predictors.picture, leads_up_to(kLongestPredictionS, kPicturePieces), stick_),
      sound_(predictors.sound, path_leads(predictors.sound_lead_s), stick_) {
    if (!predictors.confirming.empty())
        confirming_.emplace(predictors.confirming, path_leads(kConfirmingLeadS), stick_);
}

tracking::SampleStatus StickFilters::correct(const tracking::PoseSample& sample,
                                             tracking::StickState& state) {
    (void)picture_.predictor->correct(sample);
    if (confirming_) (void)confirming_->predictor->correct(sample);
    const tracking::SampleStatus status = sound_.predictor->correct(sample);
    picture_.predictor->require_working();
    sound_.predictor->require_working();
    write_paths(state);  // a sample that one filter refuses may count for another
    if (!is_taken(status)) {
        ++state.refused;
        return status;
    }
    ++state.samples;
    if (status == tracking::SampleStatus::reinitialised) ++state.starts;
    state.t_s = sample.t_s;
    state.position = sample.position;
    state.orientation = sample.orientation;
    state.oriented = sample.has_orientation ? 1 : 0;
    return status;
}

void StickFilters::write_paths(tracking::StickState& state) const {
    const tracking::Predictor &picture = *picture_.predictor, &sound = *sound_.predictor;
    state.picture = path_of(picture, kLongestPredictionS, kPicturePieces);
    state.picture_t_s = picture.time_s();
    state.sound = path_of(sound, sound_lead_s_, kPathPieces);
    state.model = sound.selected();
    state.models = sound.models();
    assert(state.models <= tracking::StickState::kMostModels);
    for (std::size_t i = 0; i < state.models && state.models > 1; ++i)
        state.sound_models[i] = sound.motion_of_model(i).value_or(state.sound_models[i]);
    if (!confirming_) return;
    state.confirms = 1;
    state.confirming = confirming_->predictor->motion().value_or(state.confirming);
    state.confirming_t_s = confirming_->predictor->time_s();
}

void StickFilters::Filter::begin_anew(const TrackedStick& stick) {
    if (auto* external = dynamic_cast<ExternalPredictor*>(predictor.get()))
        external->begin_anew();
    else
        predictor = maker.make({}, stick);
}

std::optional<tracking::Experience> StickFilters::experience() const {
    std::optional<tracking::Experience> all = tracking::experience_of(*picture_.predictor, stick_.name);
    if (all && earlier_) *all += *earlier_;
    return all;
}

void StickFilters::begin_anew() {
    earlier_ = experience();
    picture_.begin_anew(stick_);
    sound_.begin_anew(stick_);
    if (confirming_) confirming_->begin_anew(stick_);
}

}  // namespace app
