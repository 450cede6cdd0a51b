#pragma once
// What is compared and what comes of it.
#include <tracking/sensor.h>
#include <tracking/training.h>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "compare/predictor_scores.h"
#include "statistics/statistics.h"

namespace app {

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

/// An estimator against the best baseline at a lead. The intervals of all estimators at a lead hold at 95 % at once
/// (Bonferroni), so that they hold for the one that is picked among them.
///
/// Baselines are hold, naive, difference and least-squares (the parabola), as named and tuned on the same
/// split as the estimator. The best one is that of least RMS on the recordings scored: the choice favours the
/// baseline, so that a gain stated is a gain.
struct PairedResult {
    std::string predictor, baseline;
    double lead_s = 0;
    double rms_mm = 0, baseline_rms_mm = 0;
    PairedDifference by_recording;              ///< an interval with five recordings or more
    std::optional<PairedDifference> by_person;  ///< with two persons or more
};

/// RMS over lead, of one predictor over all recordings.
struct LeadCurve {
    std::string predictor;
    std::vector<std::pair<double, double>> rms_mm;    ///< lead [s], RMS
    std::vector<std::pair<double, HitScore>> hits{};  ///< lead [s], strikes; of those that tells_how_far()

    /// The lead at which the RMS passes a value [s]; none where it does not.
    [[nodiscard]] std::optional<double> passes(double rms) const;
    /// The lead at which the strikes' F1 falls below a value [s]; none where it does not.
    [[nodiscard]] std::optional<double> falls_below(double f1) const;
};
/// Whether the question how far ahead one can predict is asked of a predictor: naive and thesis of 1992, auto, and
/// what is learned.
[[nodiscard]] bool tells_how_far(const std::string& predictor);

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

/// A file that was read.
struct InputFile {
    std::string file, sha256;
};

/// What to compare, and how it is sensed.
struct ComparisonOptions {
    std::vector<std::string> arguments;  ///< of the command that asks, for the record
    std::vector<std::string> traces, predictors, tune_traces;
    std::vector<std::string> transfer;   ///< persons or traces to train a network on, and to tune on
    tracking::TrainingOptions training;  ///< of that network
    double false_cost = 1;               ///< of a false sound; that of a missed strike is 1 (StrikeDecision)
    std::vector<std::pair<std::string, std::string>> predictions;  ///< name, file in `predict`'s format
    PersonNames persons;
    std::vector<double> leads_s;
    tracking::SensorModel sensor;
    StrikeSurface surface;
    std::string surface_text;  ///< as given
    bool tuning = true, cost = true, map = false;
    std::optional<std::string> samples;  ///< file for every single error (SampleRows)
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
    std::string tuned_on;        ///< one sentence
    std::size_t estimators = 0;  ///< entrants that are no baselines: intervals hold for all of them at once
    std::vector<InputFile> inputs;
};

/// Compares. A pure function of the files and options but for ns_per_sample and `exec:` predictors with a
/// state of their own. Predictors named bare or with parameters run as they are; of each family that has
/// parameters to tune, `NAME*` runs those that erred least (RMS, at that lead) on other recordings (the
/// `--tune` ones, or all others that are compared), and `NAME**` those from the recordings of other persons;
/// the advance of `auto`'s strikes is learned on the same recordings as `NAME*`. A map tunes on all others
/// that are compared, `--tune` or not. Throws BadInput (also where nothing can be scored, or two files hold
/// the same samples), tracking::TraceError.
[[nodiscard]] Comparison compare(const ComparisonOptions& options);

/// The sensors of a map: every combination.
struct MapAxes {
    std::vector<double> rates_hz = {30, 60, 120, 240};
    std::vector<double> noises_mm = {0.1, 0.25, 1, 4};
    std::vector<double> jitters_ms = {0, 3};
    std::vector<double> drop_outs = {0, 0.1};
};

/// Position errors of the families of `predictors` (tuned where they have parameters; as named otherwise)
/// over all sensors of `axes`, by sensor, lead, predictor. Samples carry their true times. With fewer than
/// two recordings there is nothing to tune on: the predictors as named. Results do not depend on `threads`.
[[nodiscard]] std::vector<MapCell> map_sensors(std::span<const Recording> recordings,
                                               const ComparisonOptions& options, const MapAxes& axes = {});

/// Of the cells of one sensor and lead, the one of least RMS among estimators.
[[nodiscard]] std::vector<MapCell> best_cells(const std::vector<MapCell>& map);

}  // namespace app
