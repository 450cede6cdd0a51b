#pragma once
// What is compared and what comes of it: settings and results, without behaviour.
#include <tracking/sensor.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/strike_evaluation.h"
#include "statistics/paired_difference.h"
#include "statistics/statistics.h"

namespace app {

/// Errors of one predictor at one lead. Lengths in mm, as compare.json's keys; of nothing kNoValue.
struct ErrorScore {
    std::size_t count = 0;      ///< predictions scored
    double sum_square_mm2 = 0;  ///< of the tracked point's position error
    double rms_mm = kNoValue, p95_mm = kNoValue;
    double free_rms_mm = kNoValue;       ///< truth outside +-50 ms of impacts and of flagged times
    double unflagged_rms_mm = kNoValue;  ///< sample and truth outside +-50 ms of flagged times
    double rotation_rms_deg = kNoValue;  ///< without flagged orientations
    double tip_rms_mm = kNoValue;  ///< position and rotation together, at the tip; where rotations count

    // What the figures are made of, so that scores can be combined.
    std::size_t free_count = 0, unflagged_count = 0, rotation_count = 0;
    double free_sum_mm2 = 0, unflagged_sum_mm2 = 0, rotation_sum_deg2 = 0, tip_sum_mm2 = 0;
    std::vector<double> errors_mm;
};

/// How honest the stated covariances are; only of predictors that state one.
struct Calibration {
    std::size_t count = 0;     ///< predictions with a stated covariance
    std::size_t singular = 0;  ///< of these, not positive definite: not in the figures
    double inside_50 = 0,
           inside_95 = 0;  ///< share of position errors inside the stated 50 and 95 % ellipsoids
    double negative_log_likelihood = 0;  ///< mean, nats, positions in m
};

/// A predictor's figures at one lead.
struct PredictorScore {
    std::string predictor;
    double lead_s = 0;
    ErrorScore error;
    std::optional<Calibration> calibration;
    std::optional<HitScore> hits;
    /// Update and the prediction at every lead; the median of several runs, and over recordings. kNoValue
    /// where not measured.
    double ns_per_sample = kNoValue;
    bool external = false;  ///< exec:, or predictions from a file: no cost is measured
};

/// On one stick of one recording: a row of compare.json's `results`.
struct ComparisonRow : PredictorScore {
    std::string trace;   ///< as given on the command line
    std::string person;  ///< who plays (Recording::person)
    std::string stick;
    std::string used;  ///< the specification that ran: `predictor`, or what tuning chose for it
    double rate_hz = 0, noise_mm = 0;
    std::optional<double> advance_s;  ///< of the strikes, if it was learned (on the recordings that tune)
};

/// Over all recordings: errors pooled over samples, strikes added.
struct ComparisonSummary : PredictorScore {
    bool baseline = false;
    std::optional<std::pair<double, double>> advance_s;  ///< least and most that was learned; none if not
};

/// An estimator against the best baseline at a lead.
///
/// Baselines are hold, naive, difference and least-squares (the parabola), as named and tuned on the same
/// split as the estimator. The best one is that of least RMS on the recordings scored: the choice favours the
/// baseline, so that a gain stated is a gain.
struct PairedResult {
    std::string predictor, baseline;
    double lead_s = 0;
    double rms_mm = 0, baseline_rms_mm = 0;
    PairedDifference by_recording;
    std::optional<PairedDifference> by_person;  ///< with two persons or more
};

/// RMS over lead, of one predictor over all recordings.
struct LeadCurve {
    std::string predictor;
    std::vector<std::pair<double, double>> rms_mm;  ///< lead [s], RMS
};

/// What a predictor said of a stick's height at one lead: (time predicted for [s], height [m]).
struct FigurePath {
    std::string predictor, used;
    double lead_s = 0;
    std::vector<std::pair<double, double>> height_m;
};

/// One stick's height as recorded and as predicted (figures 3-1 to 3-3 of the thesis).
struct StickFigure {
    std::string trace, stick;
    double from_s = 0, to_s = 0, zoom_from_s = 0, zoom_to_s = 0;
    std::vector<std::pair<double, double>> recorded_m;
    std::vector<FigurePath> paths;
};

/// One estimator at one lead under one sensor, against the best baseline there. Both are tuned on other
/// recordings for that very sensor.
struct MapCell {
    double rate_hz = 0, noise_mm = 0, jitter_ms = 0, drop_out = 0;
    PairedResult result;
};

/// What to compare, and how it is sensed.
struct ComparisonOptions {
    std::vector<std::string> traces, predictors, tune_traces;
    std::vector<std::pair<std::string, std::string>> predictions;  ///< name, file in `predict`'s format
    std::vector<std::pair<std::string, std::string>> persons;      ///< text in the path, name
    std::vector<double> leads_s;
    tracking::SensorModel sensor;
    StrikeSurface surface;
    std::string surface_text;  ///< as given
    double release_margin_s = 0.010;
    bool tuning = true, cost = true, map = false;
    unsigned threads = 1;
    std::function<void(double)> progress;  ///< share of the work done; may be empty
};

struct Comparison {
    ComparisonOptions options;
    std::vector<std::string> persons;                             ///< by first appearance
    std::vector<std::pair<std::string, std::string>> predictors;  ///< shown name, what it is
    std::vector<ComparisonRow> rows;                              ///< by recording, stick, predictor, lead
    std::vector<ComparisonSummary> summaries;
    std::vector<PairedResult> paired;
    std::vector<LeadCurve> curves;
    StickFigure figure;
    std::vector<MapCell> map;
    std::string tuned_on;  ///< one sentence
};

}  // namespace app
