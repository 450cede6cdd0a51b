#include "filter/model_bank.h"

#include <algorithm>
#include <cmath>

#include "tracking/rotation.h"

namespace tracking {
namespace {

/// variance on every axis, and d d^T.
Eigen::Matrix3d spread(double variance, const Eigen::Vector3d& d) {
    return variance * Eigen::Matrix3d::Identity() + d * d.transpose();
}

}  // namespace

ModelBank::ModelBank(const Options& options)
    : gate_(OutlierGate::of_positions(options.gate_sigmas)),
      position_{PositionFilter(options.models[0]), PositionFilter(options.models[1]),
                PositionFilter(options.models[2])},
      rotation_{RotationFilter(options.models[0], options.gate_sigmas),
                RotationFilter(options.models[1], options.gate_sigmas),
                RotationFilter(options.models[2], options.gate_sigmas)},
      lead_s_(options.lead_s),
      score_(options.score),
      history_(kHistory) {}

SampleStatus ModelBank::correct(const PoseSample& sample) noexcept {
    return clock_.take(
        sample, [this](const PoseSample& first) { return start(first); },
        [this](const PoseSample& next) { return update(next); });
}

SampleStatus ModelBank::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    gate_.restart(sample.position);
    for (std::size_t i = 0; i < kModels; ++i) {
        position_[i].start(sample.position);
        rotation_[i].start(sample);
    }
    selected_ = 0;
    held_ = age_ = 0;
    remember({0, 0, 0}, {1, 1, 1});
    return SampleStatus::reinitialised;
}

SampleStatus ModelBank::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    std::array<PositionFilter::Estimate, kModels> ahead;
    for (std::size_t i = 0; i < kModels; ++i) ahead[i] = position_[i].propagate(dt);
    if (gate_.is_on()) {
        const double square = ahead[selected_].innovation(sample.position).matrix().squaredNorm();
        const OutlierGate::Verdict verdict = gate_.judge(
            sample.position, dt, square, position_[selected_].innovation_variance(ahead[selected_]));
        if (verdict == OutlierGate::Verdict::refuse) return SampleStatus::outlier;
        if (verdict == OutlierGate::Verdict::persists) return start(sample);
    }
    bool finite = true;
    PerModel square{}, variance{};
    for (std::size_t i = 0; i < kModels; ++i) {
        const Lanes innovation = ahead[i].innovation(sample.position);
        square[i] = innovation.matrix().squaredNorm();
        variance[i] = position_[i].innovation_variance(ahead[i]);
        position_[i].correct(ahead[i], innovation);
        rotation_[i].update(sample, dt);
        finite = finite && ahead[i].x.is_finite() && rotation_[i].is_finite();
    }
    if (!finite) return start(sample);
    for (std::size_t i = 0; i < kModels; ++i) position_[i].accept(ahead[i]);
    clock_.advance(sample.t_s);
    select(sample);
    remember(square, variance);
    return SampleStatus::accepted;
}

void ModelBank::remember(const PerModel& innovation_square, const PerModel& innovation_variance) noexcept {
    newest_ = (newest_ + 1) % kHistory;
    Past& now = history_[newest_];
    now.t_s = clock_.time_s();
    now.innovation_square = innovation_square;
    now.innovation_variance = innovation_variance;
    for (std::size_t i = 0; i < kModels; ++i) {
        now.x[i] = position_[i].now().x;
        if (score_ == BankScore::likelihood) now.p[i] = position_[i].now().p;
    }
    if (held_ < kHistory) ++held_;
}

double ModelBank::penalty(std::size_t model, const Past& past, double elapsed,
                          const Lanes& measured) const noexcept {
    const MotionModel& motion = position_[model].model();
    const auto square = [&](const Transition& f) {
        const AxisStates& x = past.x[model];
        return (measured - (x.p + f.pv * x.v + f.pa * x.a)).matrix().squaredNorm();
    };
    if (score_ == BankScore::distance) return square(motion.transition(elapsed));
    const MotionStep step = motion.step(elapsed);
    const double variance = propagated(past.p[model], step).pp + motion.measurement_variance;
    return square(step.f) / variance + 3 * std::log(variance);  // -2 log (3.27), its constant left out
}

void ModelBank::select(const PoseSample& sample) noexcept {
    // The entry nearest to one lead ago; from one sample to the next its age changes little.
    const auto miss = [&](std::size_t age) { return std::abs(sample.t_s - past(age).t_s - lead_s_); };
    std::size_t age = std::min(age_ + 1, held_ - 1);
    while (age > 0 && miss(age - 1) < miss(age)) --age;
    while (age + 1 < held_ && miss(age + 1) < miss(age)) ++age;
    age_ = age;
    const double elapsed = sample.t_s - past(age).t_s;
    const double period = clock_.time_s() - past(0).t_s;
    if (elapsed < lead_s_ - period / 2) return;
    const Lanes measured = to_lanes(sample.position);
    // (3.28): the model whose prediction of a lead ago was nearest, or (3.27): most likely.
    double least = penalty(0, past(age), elapsed, measured);
    selected_ = 0;
    for (std::size_t i = 1; i < kModels; ++i) {
        const double other = penalty(i, past(age), elapsed, measured);
        if (other < least) least = other, selected_ = i;
    }
}

PosePrediction ModelBank::predict_model(std::size_t index, double lead_s) const noexcept {
    return rotation_[index].pose(position_[index].after(lead_s), lead_s);
}

ModelBank::PerModel ModelBank::probabilities() const noexcept {
    PerModel log_likelihood{};
    for (std::size_t age = 0; age < std::min(held_, kEvidence); ++age)
        for (std::size_t i = 0; i < kModels; ++i) {
            const double variance = past(age).innovation_variance[i];
            log_likelihood[i] -= 0.5 * (past(age).innovation_square[i] / variance + 3 * std::log(variance));
        }
    const double best = *std::max_element(log_likelihood.begin(), log_likelihood.end());
    PerModel weight{};
    double sum = 0;
    for (std::size_t i = 0; i < kModels; ++i) sum += weight[i] = std::exp(log_likelihood[i] - best);
    for (double& w : weight) w /= sum;
    return weight;
}

std::optional<PoseCovariance> ModelBank::covariance(double lead_s) const noexcept {
    const PerModel weight = probabilities();
    const PosePrediction chosen = predict(lead_s);
    PoseCovariance sum;
    for (std::size_t i = 0; i < kModels; ++i) {
        const PosePrediction other = predict_model(i, lead_s);
        const AxisMatrix<double> p = position_[i].covariance_after(lead_s);
        sum.position += weight[i] * spread(p.pp, other.position - chosen.position);
        sum.velocity += weight[i] * spread(p.vv, other.velocity - chosen.velocity);
        sum.rotation += weight[i] * spread(rotation_[i].variance_after(lead_s),
                                           logarithm(other.orientation * chosen.orientation.conjugate()));
    }
    return sum;
}

}  // namespace tracking
