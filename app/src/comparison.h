#pragma once
#include <tracking/sensor.h>
#include <tracking/trace.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "strike_evaluation.h"

namespace app {

/// Errors of one predictor at one lead on one stick of one recording. Lengths in mm, as compare.json's keys.
struct ErrorScore {
    std::size_t count = 0;      ///< predictions scored
    double sum_square_mm2 = 0;  ///< of the tracked point's position error
    double rms_mm = 0, p95_mm = 0;
    double free_rms_mm = 0;       ///< outside +-50 ms of impacts and of flagged times
    double rotation_rms_deg = 0;  ///< 0 without orientation
    double tip_rms_mm = 0;        ///< position and rotation together, at the tip
};

/// How honest the stated covariances are; only of predictors that state one.
struct Calibration {
    std::size_t count = 0;
    double inside_50 = 0,
           inside_95 = 0;  ///< share of position errors inside the stated 50 and 95 % ellipsoids
    double negative_log_likelihood = 0;  ///< mean, nats, positions in m
};

/// One row of compare.json's `results`.
struct ComparisonRow {
    std::string trace;   ///< as given on the command line
    std::string person;  ///< who plays: the file's folder and the first word of its name ("p3")
    std::string stick, predictor;
    std::string used;  ///< the specification that ran: `predictor`, or what tuning chose for it
    double lead_s = 0, rate_hz = 0, noise_mm = 0;
    ErrorScore error;
    std::optional<Calibration> calibration;
    std::optional<HitScore> hits;
    double ns_per_sample = 0;  ///< update and the prediction at every lead; median of several runs
};

}  // namespace app
