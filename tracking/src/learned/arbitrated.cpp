#include "learned/arbitrated.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kRecentS = 2, kLongS = 10;
constexpr double kSilentS = 0.25;
constexpr double kClearlyBetter = 0.85, kSurelyBetter = 0.7;  // of the filter's RMS
constexpr double kIndependentS = 0.15;                        // errors closer together are much alike
constexpr double kMostPendingHz = 500;  // predictions made more often are not all remembered
constexpr double kSpreadOfWay = 0.3;    // of the filter, by the way at the recent speed
constexpr double kStep50 = 0.06, kStep95 = 0.2, kFirstSteps = 3, kSettlingErrors = 100;
constexpr double kErrorsOfMean = 200;
constexpr double kMostLog = Trust::kMostLog;
constexpr double kLeastSpreadM = 1e-4;

static_assert(kNodes == Trust::kLeads);

}  // namespace

void Arbiter::learn(const Eigen::Vector3d& filter, const Eigen::Vector3d& model, const Eigen::Vector3d& truth,
                    double dt_s) noexcept {
    const Eigen::Vector3d way = model - filter, error = filter - truth;
    const double recent = std::exp(-dt_s / kRecentS), long_past = std::exp(-dt_s / kLongS);
    sums_.against = recent * sums_.against - dt_s * error.dot(way);
    sums_.square = recent * sums_.square + dt_s * way.squaredNorm();
    sums_.filter_recent = recent * sums_.filter_recent + dt_s * error.squaredNorm();
    sums_.filter_square = long_past * sums_.filter_square + dt_s * error.squaredNorm();
    sums_.model_square = long_past * sums_.model_square + dt_s * (model - truth).squaredNorm();
    sums_.known_s += dt_s;
    weigh();
}

void Arbiter::begin_with(const Trust::Sums& sums) noexcept {
    sums_ = sums;
    weigh();
}

void Arbiter::weigh() noexcept {
    share_ = 0;
    constexpr double kClearly = kClearlyBetter * kClearlyBetter, kSurely = kSurelyBetter * kSurelyBetter;
    const bool better = sums_.model_square < kClearly * sums_.filter_square;
    if (sums_.known_s < kSilentS || !better || !(sums_.square > 0)) return;
    const double a = sums_.against / sums_.square,
                 left = std::max(0.0, sums_.filter_recent - a * sums_.against);
    const double independent = std::max(1.0, std::min(sums_.known_s, kRecentS) / kIndependentS);
    const double doubt =
        std::clamp((sums_.model_square / sums_.filter_square - kSurely) / (kClearly - kSurely), 0.0, 1.0);
    share_ = std::clamp(a - doubt * std::sqrt(left / (sums_.square * independent)), 0.0, 1.0);
}

void RegionScale::learn(double square, const Radii& stated) noexcept {
    scale_.errors += 1;
    scale_.mean += (square - scale_.mean) / std::min(scale_.errors + 1, kErrorsOfMean);
    const double longer = 1 + (kFirstSteps - 1) * std::exp(-scale_.errors / kSettlingErrors);
    Radii& radii = scale_.radii;
    const auto follow = [&](double Radii::*log, double step, double outside) {
        const double miss = (square > std::exp(stated.*log) ? 1.0 : 0.0) - outside;
        radii.*log = std::clamp(radii.*log + longer * step * miss, -kMostLog, kMostLog);
    };
    follow(&Radii::log_50, kStep50, 0.5);
    follow(&Radii::log_95, kStep95, 0.05);
    radii.log_95 = std::max(radii.log_50, radii.log_95);
}

void RegionScale::apply(PoseCovariance& covariance) const noexcept {
    const double factor = std::max(scale_.mean / 3, std::exp(-kMostLog));
    covariance.position *= factor;
    covariance.radius_50 = std::exp(scale_.radii.log_50) / factor;
    covariance.radius_95 = std::exp(scale_.radii.log_95) / factor;
}

Arbitrated::Arbitrated(std::unique_ptr<Predictor> filter, const PathModel& model,
                       const Eigen::Vector3d& shaft, double memory_s)
    : filter_(std::move(filter)), learned_(model, shaft, memory_s), shaft_(shaft) {
    for (std::size_t l = 0; l < kNodes; ++l)
        leads_[l].ring.resize(static_cast<std::size_t>(kPathLeads[l] * kMostPendingHz) + 2);
}

Trust Arbitrated::trust() const {
    Trust trust;
    for (std::size_t l = 0; l < kNodes; ++l)
        trust.leads[l] = {leads_[l].position.sums(), leads_[l].shaft.sums(), leads_[l].regions.scale()};
    return trust;
}

void Arbitrated::begin_with(const Trust& trust) noexcept {
    for (std::size_t l = 0; l < kNodes; ++l) {
        leads_[l].position.begin_with(trust.leads[l].position);
        leads_[l].shaft.begin_with(trust.leads[l].shaft);
        leads_[l].regions.begin_with(trust.leads[l].regions);
    }
}

SampleStatus Arbitrated::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = filter_->correct(sample);
    if (!is_taken(status)) return status;
    if (status == SampleStatus::reinitialised) {
        for (std::size_t l = 0; l < kNodes; ++l) {
            leads_[l].count = 0;
            leads_[l].last_due_s = sample.t_s + kPathLeads[l];
        }
        learned_.forget();
        oriented_ = false;
    } else {
        judge(sample);
    }
    (void)learned_.correct(sample);
    newest_ = sample;
    newest_.orientation.normalize();
    oriented_ = oriented_ || sample.has_orientation;
    remember();
    return status;
}

/// The truth is the path between the newest two samples.
void Arbitrated::judge(const PoseSample& sample) noexcept {
    const double step_s = sample.t_s - newest_.t_s;
    const bool turned = sample.has_orientation && newest_.has_orientation;
    for (Lead& lead : leads_)
        for (; lead.count > 0 && lead.ring[lead.first].due_s <= sample.t_s;
             lead.first = (lead.first + 1) % lead.ring.size(), --lead.count) {
            const Pending& p = lead.ring[lead.first];
            const double share = (p.due_s - newest_.t_s) / step_s;
            const double dt_s = std::clamp(p.due_s - lead.last_due_s, 0.0, kGapS);
            lead.last_due_s = p.due_s;
            const Eigen::Vector3d truth = newest_.position + share * (sample.position - newest_.position);
            lead.position.learn(p.filter, p.model, truth, dt_s);
            const Eigen::LLT<Eigen::Matrix3d> root(p.covariance);
            if (root.info() == Eigen::Success)
                lead.regions.learn(
                    root.matrixL().solve(p.filter + p.share * (p.model - p.filter) - truth).squaredNorm(),
                    p.radii);
            if (!turned || p.filter_shaft.isZero(0)) continue;
            const Eigen::Vector3d before = newest_.orientation * shaft_,
                                  now = sample.orientation.normalized() * shaft_;
            lead.shaft.learn(p.filter_shaft, p.model_shaft, before + share * (now - before), dt_s);
        }
}

void Arbitrated::remember() noexcept {
    const PathSpreads spreads = learned_.spreads();
    for (std::size_t l = 0; l < kNodes; ++l) {
        Lead& lead = leads_[l];
        if (lead.count == lead.ring.size()) continue;
        const PosePrediction filter = filter_->predict(kPathLeads[l]),
                             model = learned_.predict(kPathLeads[l]);
        Pending& p = lead.ring[(lead.first + lead.count++) % lead.ring.size()];
        p = {newest_.t_s + kPathLeads[l],
             lead.position.share(),
             filter.position,
             model.position,
             Eigen::Vector3d::Zero(),
             Eigen::Vector3d::Zero(),
             unscaled(kPathLeads[l], spreads),
             lead.regions.radii()};
        if (!oriented_) continue;
        p.filter_shaft = filter.orientation * shaft_;
        p.model_shaft = model.orientation * shaft_;
    }
}

Arbitrated::Share Arbitrated::share(double lead_s, Arbiter Lead::*of) const noexcept {
    std::size_t i = 0;
    while (i < kNodes && kPathLeads[i] <= lead_s) ++i;
    const auto at = [&](std::size_t l) { return (leads_[l].*of).share(); };
    if (i == 0) return {at(0), 0};
    if (i == kNodes) return {at(kNodes - 1), 0};
    const double slope = (at(i) - at(i - 1)) / (kPathLeads[i] - kPathLeads[i - 1]);
    return {at(i - 1) + slope * (lead_s - kPathLeads[i - 1]), slope};
}

PosePrediction Arbitrated::predict(double lead_s) const noexcept {
    PosePrediction pose = filter_->predict(lead_s);
    const Share of_position = share(lead_s, &Lead::position), of_shaft = share(lead_s, &Lead::shaft);
    if (of_position.value == 0 && of_position.slope == 0 && of_shaft.value == 0) return pose;
    const PosePrediction model = learned_.predict(lead_s);
    const Eigen::Vector3d way = model.position - pose.position;
    pose.position += of_position.value * way;
    pose.velocity += of_position.value * (model.velocity - pose.velocity) + of_position.slope * way;
    if (!oriented_ || of_shaft.value == 0) return pose;
    const Eigen::Vector3d turn = logarithm(model.orientation * pose.orientation.conjugate());
    pose.orientation = (exponential(of_shaft.value * turn) * pose.orientation).normalized();
    pose.angular_velocity += of_shaft.value * (model.angular_velocity - pose.angular_velocity);
    return pose;
}

Eigen::Matrix3d Arbitrated::unscaled(double lead_s, const PathSpreads& spreads) const noexcept {
    const double a = share(lead_s, &Lead::position).value;
    const double spread = kLeastSpreadM + kSpreadOfWay * lead_s * learned_.path().frame().speed;
    Eigen::Matrix3d covariance = (1 - a) * (1 - a) * spread * spread * Eigen::Matrix3d::Identity();
    if (a > 0) covariance += a * a * learned_.path().covariance(lead_s, spreads).position;
    return covariance;
}

std::optional<PoseCovariance> Arbitrated::covariance(double lead_s) const noexcept {
    std::size_t l = 0;
    while (l + 1 < kNodes && kPathLeads[l] < lead_s) ++l;
    const double share = this->share(lead_s, &Lead::shaft).value;
    PoseCovariance covariance = filter_->covariance(lead_s).value_or(PoseCovariance{});
    const PathSpreads spreads = learned_.spreads();
    const PoseCovariance of_model = learned_.path().covariance(lead_s, spreads);
    covariance.position = unscaled(lead_s, spreads);
    leads_[l].regions.apply(covariance);
    covariance.rotation += share * (of_model.rotation - covariance.rotation);
    return covariance;
}

}  // namespace tracking
