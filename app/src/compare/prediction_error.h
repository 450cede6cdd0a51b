#pragma once
#include <tracking/predictor.h>

#include <optional>
#include <vector>

#include "compare/recording.h"
#include "statistics/statistics.h"

namespace app {

/// Errors of one predictor at one lead; the RMS of each, in mm or degrees, is a figure of compare.json.
struct ErrorScore {
    SquareSum position;   ///< of the tracked point [mm]
    SquareSum free;       ///< likewise, truth outside +-50 ms of impacts and of flagged times
    SquareSum unflagged;  ///< likewise, sample and truth outside +-50 ms of flagged times
    SquareSum rotation;   ///< without flagged orientations [degrees]
    SquareSum tip;        ///< position and rotation together, at the tip; where rotations count [mm]
    std::vector<double> errors_mm;  ///< of the tracked point

    [[nodiscard]] double p95_mm() const { return quantile(errors_mm, 0.95); }
    void add(const tracking::PosePrediction& predicted, const Truth& truth, const Eigen::Vector3d& tip_body);
    /// Both together, as if one recording followed the other.
    void add(const ErrorScore& other);
};

/// How honest the stated covariances are; only of predictors that state one.
struct Calibration {
    std::size_t count = 0;     ///< predictions with a stated covariance
    std::size_t singular = 0;  ///< of these, not positive definite: not in the figures
    double inside_50 = 0,
           inside_95 = 0;  ///< share of position errors inside the stated 50 and 95 % ellipsoids
    double negative_log_likelihood = 0;  ///< mean, nats, positions in m
};
/// Both together, as if one recording followed the other.
void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other);

/// The errors of predictions at one lead, as they are made.
struct LeadScore {
    ErrorScore error;
    Calibration sums;  ///< of what calibration() has the means of

    /// `covariance`: of the position [m^2], as the predictor states it; may be absent.
    void add(const tracking::PosePrediction& predicted, const Truth& truth, const Eigen::Vector3d& tip_body,
             const std::optional<tracking::PoseCovariance>& covariance);
    [[nodiscard]] std::optional<Calibration> calibration() const;
};

/// Errors of a predictor (fresh, fed here) at every lead of the stick, in one pass over its samples. A
/// prediction is for sample time + lead also where the predictor ignored the sample.
[[nodiscard]] std::vector<LeadScore> score_predictor(const SensedStick& stick,
                                                     tracking::Predictor& predictor);

/// The position errors alone [mm], for tuning and maps: orientation is neither filtered nor scored.
[[nodiscard]] std::vector<SquareSum> score_positions(const SensedStick& stick,
                                                     tracking::Predictor& predictor);

}  // namespace app
