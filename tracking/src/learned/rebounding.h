#pragma once
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "learned/network.h"
#include "tracking/predictor.h"

namespace tracking {

/// The path of another predictor, reflected at the height h at which the stick's strokes turn back up.
///
///   y = h - d under h becomes h + e d,  e = (sum w d y - c) / (sum w d^2 + c),  -1 <= e <= 1.5
///   vy becomes -e vy
///
/// for each lead, with y the true height over h, w = dt exp(-age / 10 s) and c = 1.7 cm^2 s. So e is the
/// coefficient of restitution by least squares, the hand's part included. It begins with -1, which leaves the
/// path as it is, and stays there where a stick passes through. A low is where the measured point has fallen
/// by 25 mm and risen by as much again; h is the mean of the lows, after the fifth an exponential one in
/// which the newest weighs 1/5. What was learned outlasts gaps.
///
/// States the covariance of the other predictor. World frame, y up. Allocates when it is made only.
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
    /// A prediction under h for a time that has not come yet.
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
