#include "learned/rebounding.h"

#include <algorithm>
#include <cmath>

namespace tracking {
namespace {

constexpr double kForgottenS = 10;
constexpr double kCautionM2s = 1.7e-4;
constexpr double kMostRebound = 1.5;
constexpr double kReboundHz = 500;  // predictions made more often are not all remembered
constexpr double kLowM = 0.025, kLowsKept = 5;

}  // namespace

Rebounding::Rebounding(std::unique_ptr<Predictor> path) : path_(std::move(path)) {
    for (std::size_t l = 0; l < kNodes; ++l)
        leads_[l].ring.resize(static_cast<std::size_t>(kPathLeads[l] * kReboundHz) + 2);
}

double Rebounding::Lead::rebound() const noexcept {
    return std::clamp((products - kCautionM2s) / (squares + kCautionM2s), -1.0, kMostRebound);
}

SampleStatus Rebounding::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = path_->correct(sample);
    if (!is_taken(status)) return status;
    const double height_m = sample.position.y();
    double dt_s = 0;
    if (status == SampleStatus::reinitialised) {
        for (Lead& lead : leads_) lead.count = 0;
        falls_ = false;
        extreme_m_ = height_m;
    } else {
        dt_s = sample.t_s - newest_s_;
        judge(sample);
        follow(height_m);
    }
    newest_s_ = sample.t_s;
    newest_m_ = height_m;
    remember(std::min(dt_s, kGapS));
    return status;
}

/// The truth is the path between the newest two samples.
void Rebounding::judge(const PoseSample& sample) noexcept {
    const double step_s = sample.t_s - newest_s_, kept = std::exp(-step_s / kForgottenS);
    for (Lead& lead : leads_) {
        lead.squares *= kept;
        lead.products *= kept;
        for (; lead.count > 0 && lead.ring[lead.first].due_s <= sample.t_s;
             lead.first = (lead.first + 1) % lead.ring.size(), --lead.count) {
            const Pending& p = lead.ring[lead.first];
            const double y = std::lerp(newest_m_, sample.position.y(), (p.due_s - newest_s_) / step_s);
            lead.squares += p.weight_s * p.depth_m * p.depth_m;
            lead.products += p.weight_s * p.depth_m * (y - p.low_m);
        }
    }
}

void Rebounding::follow(double height_m) noexcept {
    extreme_m_ = falls_ ? std::min(extreme_m_, height_m) : std::max(extreme_m_, height_m);
    if (std::abs(height_m - extreme_m_) < kLowM) return;
    if (falls_) {
        lows_ = std::min(lows_ + 1, kLowsKept);
        low_m_ = lows_ == 1 ? extreme_m_ : low_m_ + (extreme_m_ - low_m_) / lows_;
    }
    falls_ = !falls_;
    extreme_m_ = height_m;
}

void Rebounding::remember(double dt_s) noexcept {
    for (std::size_t l = 0; l < kNodes; ++l) {
        Lead& lead = leads_[l];
        if (lead.count == lead.ring.size()) continue;
        const double depth_m = low_m_ - path_->predict(kPathLeads[l]).position.y();
        if (!(depth_m > 0)) continue;
        lead.ring[(lead.first + lead.count++) % lead.ring.size()] = {newest_s_ + kPathLeads[l], depth_m,
                                                                     low_m_, dt_s};
    }
}

PosePrediction Rebounding::predict(double lead_s) const noexcept {
    PosePrediction pose = path_->predict(lead_s);
    const double depth_m = low_m_ - pose.position.y();
    if (!(depth_m > 0)) return pose;
    std::size_t i = 0;
    while (i < kNodes && kPathLeads[i] <= lead_s) ++i;
    double rebound = leads_[i == 0 ? 0 : i - 1].rebound(), slope = 0;
    if (i > 0 && i < kNodes) {
        slope = (leads_[i].rebound() - rebound) / (kPathLeads[i] - kPathLeads[i - 1]);
        rebound += slope * (lead_s - kPathLeads[i - 1]);
    }
    pose.position.y() += (1 + rebound) * depth_m;
    pose.velocity.y() = slope * depth_m - rebound * pose.velocity.y();
    return pose;
}

}  // namespace tracking
