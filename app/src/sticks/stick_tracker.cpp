#include "sticks/stick_tracker.h"

#include <algorithm>

#include "sticks/auto_predictor.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr int kPicturePieces = 9;  // frames ask any lead up to that; external predictors answer each 1/60 s

}  // namespace

StickTracker::StickTracker(std::uint32_t stick, const std::string& name, const StickGeometry& geometry,
                           const std::string& picture_predictor, const std::string& sound_predictor,
                           double sound_lead_s)
    : StickOutlook(stick, geometry),
      sound_lead_s_(sound_lead_s),
      picture_(make_any_predictor(picture_specification(picture_predictor),
                                  leads_up_to(kLongestPredictionS, kPicturePieces), name)),
      sound_(make_any_predictor(sound_specification(sound_predictor), path_leads(sound_lead_s), name)) {
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
        measured_tip_ = sample.position + sample.orientation * geometry().tip;
        started_ = true;
    }
    return status;
}

}  // namespace app
