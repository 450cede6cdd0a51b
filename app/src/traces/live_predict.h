#pragma once
#include <tracking/predictor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kit/kit.h"
#include "sensors/sample_source.h"

namespace app {

struct PredictedPose {
    double lead_s = 0;
    tracking::PosePrediction pose;
    std::optional<tracking::PoseCovariance> covariance;  ///< none where the predictor states none
};

/// A NextStrike, by the instrument's name.
struct NamedStrike {
    double in_s = 0, probability = 0;
    std::string instrument;
};

/// What is sent for a sample.
struct Prediction {
    std::string stick;
    double t_s = 0;  ///< of the sample, as its source gave it; without a time, CLOCK_MONOTONIC of its arrival
    bool oriented = false;             ///< the stick has shown an orientation
    std::vector<PredictedPose> poses;  ///< in the order of the leads asked for
    std::optional<NamedStrike> strike;
};

/// Where predictions go. One thread.
class PredictionSink {
public:
    virtual ~PredictionSink() = default;
    virtual void send(const Prediction& prediction) = 0;
    /// So many of them could not be sent.
    [[nodiscard]] virtual std::uint64_t unsent() const { return 0; }
};

/// `osc:PORT` (of this machine), `osc:HOST:PORT` or `zmq:ENDPOINT` (a publisher that binds it). The messages are
/// in assets/predictions.md. A host's name is looked up now, once. Throws BadInput for what is none,
/// std::runtime_error for an endpoint that is taken.
[[nodiscard]] std::unique_ptr<PredictionSink> open_prediction_sink(const std::string& destination);
/// Rows on standard output, as predict_table() has them; for one lead.
[[nodiscard]] std::unique_ptr<PredictionSink> make_row_sink();

struct LivePredictOptions {
    SourceOptions source;
    std::string predictor;
    std::vector<double> leads_s;
    std::optional<Eigen::Vector3d> tip, shaft;  ///< of the sticks; else the source's
    std::optional<Kit> kit;                     ///< for strikes
    double seconds = 0;  ///< from the first sample on; 0: until the source ends or a signal comes
};

struct LivePredictResult {
    std::uint64_t answers = 0;
    std::uint64_t left_out = 0;               ///< samples before an older one of their stick
    std::uint64_t unsent = 0;                 ///< answers that could not be sent
    double p50_s = 0, p99_s = 0, most_s = 0;  ///< from a sample's arrival to its answer's departure
    SourceFaults faults;
};

/// Answers each sample that is newer than all before it of its stick, from the second one on, as soon as it comes. A
/// stray time costs no more than three samples (SourceClock). Samples may come faster or slower than they were taken:
/// their times alone are looked at, so that answers do not depend on the load.
/// Throws BadInput for what cannot be, std::runtime_error when the source or an external predictor fails.
[[nodiscard]] LivePredictResult predict_live(const LivePredictOptions& options, PredictionSink& sink);

}  // namespace app
