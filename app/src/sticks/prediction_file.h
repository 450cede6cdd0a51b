#pragma once
#include <tracking/predictor.h>
#include <tracking/trace.h>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace app {

/// Predictions in the format of `musicworld predict`: a trace whose t is the time predicted for. Units, axes
/// and orientations as in any trace.
struct PredictionFile {
    tracking::Trace rows;
    std::vector<std::vector<std::size_t>> lines;  ///< of each stick's rows: the line in the file
};

/// Throws tracking::TraceError or BadInput: FILE:LINE:COLUMN: error: found ..., expected ...; what to do.
[[nodiscard]] PredictionFile read_prediction_file(const std::filesystem::path& file);

/// One stick's predictions: rows[i] is what was predicted from samples 0 to i + 1, counting the samples that
/// are newer than all before.
struct StickPredictions {
    double lead_s = 0;
    std::vector<tracking::PoseSample> rows;
};

/// The predictions that belong to a stick's samples (in order of arrival; those not newer than one before
/// them do not count). Throws BadInput, with its place, unless there is a row for each from the second on, a
/// constant lead (within 1e-9 s and the rounding of t) after it.
[[nodiscard]] StickPredictions match_predictions(const PredictionFile& file, const std::string& stick,
                                                 std::span<const tracking::PoseSample> samples);

/// Replays predictions to a caller that feeds the samples they were matched to: exact at their lead; nearer leads
/// lie on the straight way there from the newest sample (orientation: slerp), farther ones on its
/// continuation. States no covariance.
[[nodiscard]] std::unique_ptr<tracking::Predictor> make_replay(StickPredictions predictions);

}  // namespace app
