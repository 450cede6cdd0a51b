#pragma once
#include <tracking/predictor.h>
#include <tracking/stick_state.h>

#include <memory>
#include <string>

namespace app {

/// The predictors of a stick, all resolved; `confirming` may be empty.
struct StickPredictors {
    std::string picture, sound, confirming;
};

/// Throws BadInput for a predictor that does not exist, or whose state cannot be handed to another process
/// (Predictor::motion()).
void require_motion(const StickPredictors& predictors);

/// One stick's filters in a sensor process: the same samples to all.
class StickFilters {
public:
    explicit StickFilters(const StickPredictors& predictors);

    /// What the sound's filter made of the sample; the filters' motions go into `state`.
    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample,
                                                 tracking::StickState& state);

private:
    void say_motions(tracking::StickState& state) const;

    std::unique_ptr<tracking::Predictor> picture_, sound_, confirming_;  // confirming_ may be none
};

}  // namespace app
