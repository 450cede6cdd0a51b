#pragma once
#include <tracking/predictor.h>

#include <algorithm>
#include <span>

#include "sticks/predictors.h"

namespace app {

/// Whether a sample became part of an estimator's state.
[[nodiscard]] inline bool is_taken(tracking::SampleStatus status) {
    return status == tracking::SampleStatus::accepted || status == tracking::SampleStatus::reinitialised;
}

/// A sample as a predictor has just answered it.
struct ReplayedSample {
    std::size_t index;  ///< among the samples
    const tracking::PoseSample& sample;
    tracking::SampleStatus status;
    /// How far the predictor's state lies behind this sample [s]; 0 if the predictor took it. What is expected
    /// `lead_s` after the sample is predict(lead_s + behind_s), also where the sample was refused.
    double behind_s;
};

/// Feeds samples to a predictor in order of arrival and calls visit(ReplayedSample) after each. Throws
/// std::runtime_error if an external predictor has failed on the way.
template <class Visit>
void replay(tracking::Predictor& predictor, std::span<const tracking::PoseSample> samples,
            const Visit& visit) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const tracking::SampleStatus status = predictor.correct(samples[i]);
        const double behind_s = is_taken(status) ? 0 : std::max(0.0, samples[i].t_s - predictor.time_s());
        visit(ReplayedSample{i, samples[i], status, behind_s});
    }
    require_working(predictor);
}

}  // namespace app
