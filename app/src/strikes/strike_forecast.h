#pragma once
#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <array>
#include <deque>
#include <optional>
#include <vector>

#include "kit/kit.h"

namespace app {

/// Where the tip is expected to meet an instrument next.
struct NextStrike {
    std::size_t body = 0;
    double in_s = 0;         ///< after the sample
    double probability = 0;  ///< that it does within kStrikeHorizonS
};

/// How far ahead strikes are looked for [s].
inline constexpr double kStrikeHorizonS = 0.15;

/// Predicts after each sample when one stick will strike next, and with which probability.
///
/// With d the distance of the tip from a surface at a lead of the predicted path, n its normal and C the
/// covariance of the tip as the predictor states it (without one, 1 mm each way), the depth is z = -d /
/// sqrt(n' C n), within +-4, and
///
///   probability = 1 / (1 + exp(-(a + b z))),  z the greatest up to the horizon         (Platt 1999)
///
/// of the body whose z is greatest; `in_s` is when the mean path meets it, or, if it does not, when z is
/// greatest. A surface that the tip is in is left out until the tip has left it. A stick stops at a surface
/// that its predicted path passes through, so the depth needs calibration: a and b begin as 0 and 1 and are
/// learned from the outcome of each forecast 0.15 s later (contacts are 3 mm deep), by gradient ascent of the
/// likelihood at a rate of 2 /s times the time between samples.
///
/// One thread. Deterministic.
class StrikeForecast {
public:
    StrikeForecast(const StickGeometry& geometry, const std::vector<sim::BodyDefinition>& bodies)
        : geometry_(geometry), bodies_(bodies), outside_(bodies.size()) {}

    /// To be called after the predictor got the sample of time t_s. `behind_s`: how far the predictor's state
    /// lies behind it (tracking::feed). None where no body is in reach.
    [[nodiscard]] std::optional<NextStrike> after(const tracking::Predictor& predictor, double t_s,
                                                  double behind_s);
    /// The leads that a predictor is asked for.
    [[nodiscard]] static std::vector<double> leads();

private:
    static constexpr std::size_t kLeads = 13;
    /// The tip at a lead, and the covariance of its position.
    struct Tip {
        double lead_s = 0;
        Eigen::Vector3d position = Eigen::Vector3d::Zero();
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    };
    using Tips = std::array<Tip, kLeads>;
    struct Depth {
        double z = 0, in_s = 0;
    };
    struct Forecast {
        double due_s = 0;
        std::size_t body = 0;
        double z = 0, weight = 0;
        bool came = false;
    };

    [[nodiscard]] Tip tip_at(const tracking::Predictor& predictor, double lead_s, double behind_s) const;
    [[nodiscard]] std::optional<Depth> depth_in(const sim::BodyDefinition& body, const Tips& tips,
                                                double distance_m) const;
    /// When the mean path between the two meets a body.
    [[nodiscard]] double meeting_s(const sim::BodyDefinition& body, const Tip& outside,
                                   const Tip& inside) const;
    [[nodiscard]] double probability(double z) const;
    void learn(double t_s);

    StickGeometry geometry_;
    std::vector<sim::BodyDefinition> bodies_;
    std::vector<bool> outside_;  // by body: the tip was outside it, and has not struck it since
    double a_ = 0, b_ = 1;
    std::optional<double> newest_s_;
    std::deque<Forecast> forecasts_;  // by time
};

}  // namespace app
