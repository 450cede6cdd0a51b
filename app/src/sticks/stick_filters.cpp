#include "sticks/stick_filters.h"

#include <fmt/format.h>

#include "files/bad_input.h"
#include "sticks/predictors.h"

namespace app {
namespace {

bool taken(tracking::SampleStatus status) {
    return status == tracking::SampleStatus::accepted || status == tracking::SampleStatus::reinitialised;
}

bool has_motion(const std::string& specification) {
    const std::unique_ptr<tracking::Predictor> predictor = make_any_predictor(specification, {});
    return taken(predictor->correct({})) && predictor->motion().has_value();
}

void require_motion_of(const std::string& specification) {
    check_specification(specification);
    if (is_external(specification) || !has_motion(specification))
        throw BadInput(fmt::format(
            "error: found predictor \"{}\" in real time, expected one whose state other processes can use; "
            "choose another, or play without --realtime",
            specification));
}

}  // namespace

void require_motion(const StickPredictors& predictors) {
    require_motion_of(predictors.picture);
    require_motion_of(predictors.sound);
    if (!predictors.confirming.empty()) require_motion_of(predictors.confirming);
}

StickFilters::StickFilters(const StickPredictors& predictors)
    : picture_(make_any_predictor(predictors.picture, {})), sound_(make_any_predictor(predictors.sound, {})) {
    if (!predictors.confirming.empty()) confirming_ = make_any_predictor(predictors.confirming, {});
}

tracking::SampleStatus StickFilters::correct(const tracking::PoseSample& sample,
                                             tracking::StickState& state) {
    (void)picture_->correct(sample);
    if (confirming_) (void)confirming_->correct(sample);
    const tracking::SampleStatus status = sound_->correct(sample);
    say_motions(state);  // a sample that one filter refuses may count for another
    if (!taken(status)) {
        ++state.refused;
        return status;
    }
    ++state.samples;
    if (status == tracking::SampleStatus::reinitialised) ++state.starts;
    state.t_s = sample.t_s;
    state.position = sample.position;
    state.orientation = sample.orientation;
    return status;
}

void StickFilters::say_motions(tracking::StickState& state) const {
    state.picture = picture_->motion().value_or(state.picture);
    state.picture_t_s = picture_->time_s();
    state.sound = sound_->motion().value_or(state.sound);
    state.model = sound_->selected();
    if (!confirming_) return;
    state.confirming = confirming_->motion().value_or(state.confirming);
    state.confirming_t_s = confirming_->time_s();
}

}  // namespace app
