#pragma once
#include <tracking/predictor.h>

#include <optional>
#include <span>
#include <vector>

#include "compare/comparison.h"
#include "compare/sensed_stick.h"

namespace app {

/// Gathers the errors of predictions at one lead.
class ErrorGatherer {
public:
    /// `covariance`: of the position [m^2], as the predictor states it; may be absent.
    void add(const tracking::PosePrediction& predicted, const Truth& truth, const Eigen::Vector3d& tip,
             const std::optional<tracking::PoseCovariance>& covariance);

    [[nodiscard]] ErrorScore error() const;
    [[nodiscard]] std::optional<Calibration> calibration() const;

private:
    void add_covariance(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance);

    ErrorScore score_;
    Calibration calibration_;
};

/// The errors of several scores together, as if one recording followed the other.
void add(ErrorScore& sum, const ErrorScore& other);
void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other);

struct LeadScore {
    ErrorScore error;
    std::optional<Calibration> calibration;
};

/// Errors of a predictor (fresh, fed here) at every lead of the stick, in one pass over its samples. A
/// prediction is for sample time + lead also where the predictor ignored the sample.
[[nodiscard]] std::vector<LeadScore> score_predictor(const SensedStick& stick,
                                                     tracking::Predictor& predictor);

/// A sum of squared position errors [mm^2].
struct SquareSum {
    double sum_mm2 = 0;
    std::size_t count = 0;

    void add(const SquareSum& other) { sum_mm2 += other.sum_mm2, count += other.count; }
    [[nodiscard]] double rms_mm() const;  ///< 0 of nothing
};

/// The position errors alone, for tuning and maps: orientation is neither filtered nor scored.
[[nodiscard]] std::vector<SquareSum> score_positions(const SensedStick& stick,
                                                     tracking::Predictor& predictor);

}  // namespace app
