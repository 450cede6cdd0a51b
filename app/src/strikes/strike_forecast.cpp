#include "strikes/strike_forecast.h"

#include <algorithm>
#include <cmath>

#include "strikes/true_contacts.h"

namespace app {
namespace {

constexpr double kDeepest = 4;
constexpr double kLearningRate = 2;  // [1/s]
constexpr double kLeastSlope = 0.1;
constexpr double kLongestWeightS = 0.05;
constexpr double kUnstatedM = 1e-3;  // standard deviation where none is stated

}  // namespace

std::vector<double> StrikeForecast::leads() {
    std::vector<double> leads;
    for (std::size_t i = 0; i < kLeads; ++i)
        leads.push_back(kStrikeHorizonS * static_cast<double>(i) / (kLeads - 1));
    return leads;
}

StrikeForecast::Tip StrikeForecast::tip_at(const tracking::Predictor& predictor, double lead_s,
                                           double behind_s) const {
    const tracking::PosePrediction pose = predictor.predict(lead_s + behind_s);
    const Eigen::Vector3d arm = pose.orientation * geometry_.tip;
    Tip tip{lead_s, pose.position + arm, kUnstatedM * kUnstatedM * Eigen::Matrix3d::Identity()};
    if (const auto covariance = predictor.covariance(lead_s + behind_s)) {
        Eigen::Matrix3d cross;  // a small rotation r moves the tip by r x arm
        cross << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
        tip.covariance += covariance->position + cross * covariance->rotation * cross.transpose();
    }
    return tip;
}

std::optional<StrikeForecast::Depth> StrikeForecast::depth_in(const sim::BodyDefinition& body,
                                                              const Tips& tips, double distance_m) const {
    bool outside = distance_m > 0, met = false;
    std::optional<Depth> deepest;
    for (std::size_t i = 1; i < tips.size(); ++i) {
        const sim::SurfacePoint at = sim::rest_distance(body, tips[i].position, geometry_.radius_m);
        if (outside) {
            const double z = -at.distance / std::sqrt(at.normal.dot(tips[i].covariance * at.normal));
            if (!deepest) deepest = Depth{z, tips[i].lead_s};
            if (z > deepest->z && !met) deepest->in_s = tips[i].lead_s;
            deepest->z = std::max(deepest->z, z);
            if (at.distance <= 0 && !met) {
                met = true;
                deepest->in_s = meeting_s(body, tips[i - 1], tips[i]);
            }
        }
        outside = outside || at.distance > 0;
    }
    return deepest;
}

double StrikeForecast::meeting_s(const sim::BodyDefinition& body, const Tip& outside,
                                 const Tip& inside) const {
    double before = 0, after = 1;  // shares of the straight way
    for (int i = 0; i < 7; ++i) {  // to 0.1 ms
        const double middle = 0.5 * (before + after);
        const Eigen::Vector3d tip = outside.position + middle * (inside.position - outside.position);
        (sim::rest_distance(body, tip, geometry_.radius_m).distance > 0 ? before : after) = middle;
    }
    return std::lerp(outside.lead_s, inside.lead_s, after);
}

double StrikeForecast::probability(double z) const {
    return 1 / (1 + std::exp(-(a_ + b_ * z)));
}

void StrikeForecast::learn(double t_s) {
    for (; !forecasts_.empty() && forecasts_.front().due_s <= t_s; forecasts_.pop_front()) {
        const Forecast& f = forecasts_.front();
        const double step = kLearningRate * f.weight * ((f.came ? 1 : 0) - probability(f.z));
        a_ += step;
        b_ = std::max(kLeastSlope, b_ + step * f.z);
    }
}

std::optional<NextStrike> StrikeForecast::after(const tracking::Predictor& predictor, double t_s,
                                                double behind_s) {
    constexpr double kFarStandardDeviations = 4;
    Tips tips;
    double reach_m = 0;
    for (std::size_t i = 0; i < tips.size(); ++i) {
        tips[i] = tip_at(predictor, kStrikeHorizonS * static_cast<double>(i) / (kLeads - 1), behind_s);
        reach_m = std::max(reach_m, (tips[i].position - tips[0].position).norm() +
                                        kFarStandardDeviations * std::sqrt(tips[i].covariance.trace()));
    }
    const double since_s = newest_s_ ? t_s - *newest_s_ : 0;
    newest_s_ = t_s;
    if (since_s > tracking::kGapS) {
        forecasts_.clear();
        outside_.assign(bodies_.size(), false);
    }
    std::optional<NextStrike> next;
    double greatest = 0;
    for (std::size_t body = 0; body < bodies_.size(); ++body) {
        const double distance =
            sim::rest_distance(bodies_[body], tips[0].position, geometry_.radius_m).distance;
        if (outside_[body] && distance <= -kContactDepth_m) {
            outside_[body] = false;
            for (Forecast& forecast : forecasts_)
                forecast.came = forecast.came || (forecast.body == body && forecast.due_s >= t_s);
        }
        outside_[body] = outside_[body] || distance > 0;
        if (distance > reach_m) continue;
        const std::optional<Depth> depth = depth_in(bodies_[body], tips, distance);
        if (!depth || (next && depth->z <= greatest)) continue;
        greatest = depth->z;
        next = NextStrike{body, depth->in_s, 0};
    }
    learn(t_s);
    if (!next) return next;
    const double z = std::clamp(greatest, -kDeepest, kDeepest);
    next->probability = probability(z);
    forecasts_.push_back(
        {t_s + kStrikeHorizonS, next->body, z, std::clamp(since_s, 0.0, kLongestWeightS), false});
    return next;
}

}  // namespace app
