#pragma once
#include <tracking/predictor.h>
#include <tracking/stick_state.h>

#include <memory>
#include <string>

namespace app {

/// What a stick's poses are predicted by.
struct StickPredictors {
    std::string picture, sound;
    std::string confirming;          ///< confirms the strikes that `sound` predicts; empty: none
    double sound_lead_s = 1.0 / 15;  ///< how far ahead contacts are looked for
};

/// With `auto` resolved. Starts nothing.
[[nodiscard]] StickPredictors stick_predictors(const std::string& picture, const std::string& sound,
                                               double sound_lead_s);

/// One stick's filters, which get the same samples: what they know is a StickState, offline and in real time.
/// One thread at a time.
class StickFilters {
public:
    /// `stick` is the name that external predictors get. Throws BadInput for predictors that do not
    /// exist, std::runtime_error for an external one that does not start.
    StickFilters(const StickPredictors& predictors, const std::string& stick);

    /// Takes the next sample and puts into `state` what the filters expect after it; returns what the sound's
    /// filter made of it, by whose clock and count the state goes. Throws std::runtime_error when an external
    /// predictor has failed.
    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample,
                                                 tracking::StickState& state);
    /// As before the first sample: times may begin again.
    void begin_anew();

private:
    void say_paths(tracking::StickState& state) const;

    StickPredictors predictors_;
    std::unique_ptr<tracking::Predictor> picture_, sound_, confirming_;  // confirming_ may be none
};

}  // namespace app
