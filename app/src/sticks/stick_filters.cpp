#include "sticks/stick_filters.h"

#include <cassert>

#include "sticks/external_predictor.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"

namespace app {
namespace {

// Frames ask any lead up to the longest; an external predictor answers each 1/60 s.
constexpr std::size_t kPicturePieces = 9;

/// What the predictor expects: its motion; where it has none, its predictions at those leads.
tracking::PosePath path_of(const tracking::Predictor& predictor, double reach_s, std::size_t pieces) {
    if (const std::optional<tracking::Motion> motion = predictor.motion()) return *motion;
    tracking::SampledMotion path(reach_s, pieces);
    for (std::size_t i = 0; i <= pieces; ++i) path.set(i, predictor.predict(path.lead_s(i)));
    return path;
}

void begin_anew(std::unique_ptr<tracking::Predictor>& predictor, const std::string& specification) {
    if (auto* external = dynamic_cast<ExternalPredictor*>(predictor.get()))
        external->begin_anew();
    else if (predictor)
        predictor = make_any_predictor(specification, {});
}

}  // namespace

StickPredictors stick_predictors(const std::string& picture, const std::string& sound, double sound_lead_s) {
    return {picture_specification(picture), sound_specification(sound), confirming_specification(sound),
            sound_lead_s};
}

StickFilters::StickFilters(const StickPredictors& predictors, const std::string& stick)
    : predictors_(predictors),
      picture_(
          make_any_predictor(predictors.picture, leads_up_to(kLongestPredictionS, kPicturePieces), stick)),
      sound_(make_any_predictor(predictors.sound, path_leads(predictors.sound_lead_s), stick)) {
    if (!predictors.confirming.empty())
        confirming_ = make_any_predictor(predictors.confirming, path_leads(kConfirmingLeadS), stick);
}

tracking::SampleStatus StickFilters::correct(const tracking::PoseSample& sample,
                                             tracking::StickState& state) {
    (void)picture_->correct(sample);
    if (confirming_) (void)confirming_->correct(sample);
    const tracking::SampleStatus status = sound_->correct(sample);
    require_working(*picture_);
    require_working(*sound_);
    say_paths(state);  // a sample that one filter refuses may count for another
    if (!is_taken(status)) {
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

void StickFilters::say_paths(tracking::StickState& state) const {
    state.picture = path_of(*picture_, kLongestPredictionS, kPicturePieces);
    state.picture_t_s = picture_->time_s();
    state.sound = path_of(*sound_, predictors_.sound_lead_s, kPathPieces);
    state.model = sound_->selected();
    state.models = sound_->models();
    assert(state.models <= tracking::StickState::kMostModels);
    for (std::size_t i = 0; i < state.models && state.models > 1; ++i)
        state.sound_models[i] = sound_->motion_of_model(i).value_or(state.sound_models[i]);
    if (!confirming_) return;
    state.confirms = 1;
    state.confirming = confirming_->motion().value_or(state.confirming);
    state.confirming_t_s = confirming_->time_s();
}

void StickFilters::begin_anew() {
    app::begin_anew(picture_, predictors_.picture);
    app::begin_anew(sound_, predictors_.sound);
    app::begin_anew(confirming_, predictors_.confirming);
}

}  // namespace app
