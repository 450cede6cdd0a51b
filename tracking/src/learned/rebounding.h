#pragma once
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "learned/network.h"
#include "tracking/predictor.h"

namespace tracking {

/// Another predictor's path, which rebounds from the height at which the stick's strokes turn back up.
///
///   y = h - d under h becomes h + e d,  e = (sum w d y - c) / (sum w d^2 + c),  -1 <= e <= 1.5
///   vy becomes -e vy
///
/// for each lead, with y the height over h that turned out, w = dt exp(-age / 10 s) and c = 1.7 cm^2 s. So e is the
/// restitution of least squares, and what the hand adds to it; it begins with -1, the path as it is, and stays there where
/// a stick passes. h is the mean of the lows before, each weighing 1/5: where the measured point has fallen by 25 mm and
/// risen by as much again. What was learned outlasts gaps.
///
/// Stated covariances are those of the other. World frame, y up. Allocates when it is made only.
class Rebounding final : public Predictor {
public:
    explicit Rebounding(std::unique_ptr<Predictor> path);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return path_->time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override {
        return path_->covariance(lead_s);
    }
    [[nodiscard]] bool heeds_orientation() const noexcept override { return path_->heeds_orientation(); }

private:
    /// A prediction under the lows, until its time comes.
    struct Pending {
        double due_s = 0, depth_m = 0, low_m = 0, weight_s = 0;
    };
    struct Lead {
        std::vector<Pending> ring;
        std::size_t first = 0, count = 0;
        double squares = 0, products = 0;  ///< [m^2 s]
        [[nodiscard]] double rebound() const noexcept;
    };
    void judge(const PoseSample& sample) noexcept;
    void remember(double dt_s) noexcept;
    void follow(double height_m) noexcept;

    std::unique_ptr<Predictor> path_;
    std::array<Lead, kNodes> leads_;
    double newest_s_ = 0, newest_m_ = 0;
    // The lows.
    double low_m_ = -std::numeric_limits<double>::infinity(), lows_ = 0;
    double extreme_m_ = 0;  // since the last turn
    bool falls_ = false;
};

}  // namespace tracking
