#include "model_bank.h"

#include <cmath>

#include "rotation.h"

namespace tracking {
namespace {

RotationFilter rotation_of(const MotionModel& model, double gate_sigmas) {
    return {model.scaled(1 / kLever), rotation_gate(gate_sigmas)};
}

}  // namespace

ModelBank::ModelBank(const Options& options)
    : gate_(position_gate(options.gate_sigmas)),
      position_{PositionFilter(options.models[0]), PositionFilter(options.models[1]),
                PositionFilter(options.models[2])},
      rotation_{rotation_of(options.models[0], options.gate_sigmas),
                rotation_of(options.models[1], options.gate_sigmas),
                rotation_of(options.models[2], options.gate_sigmas)},
      lead_s_(options.lead_s),
      score_(options.score),
      times_s_(kHistory),
      states_(kHistory),
      covariances_(score_ == BankScore::likelihood ? kHistory : 0) {}

SampleStatus ModelBank::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::accepted) return update(sample);
    return status == SampleStatus::reinitialised ? start(sample) : status;
}

SampleStatus ModelBank::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    gate_.restart(sample.position);
    for (std::size_t i = 0; i < kModels; ++i) {
        position_[i].start(sample.position);
        rotation_[i].restart();
        if (sample.has_orientation) rotation_[i].correct(sample.orientation);
    }
    selected_ = 0;
    held_ = age_ = 0;
    remember();
    return SampleStatus::reinitialised;
}

SampleStatus ModelBank::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    std::array<PositionFilter::Estimate, kModels> ahead;
    for (std::size_t i = 0; i < kModels; ++i) ahead[i] = position_[i].propagate(dt);
    if (gate_.is_on()) {
        const double square = ahead[selected_].innovation(sample.position).matrix().squaredNorm();
        switch (gate_.judge(sample.position, dt, square,
                            position_[selected_].innovation_variance(ahead[selected_]))) {
            case OutlierGate::Verdict::refuse:
                return SampleStatus::outlier;
            case OutlierGate::Verdict::persists:
                return start(sample);
            case OutlierGate::Verdict::pass:
                break;
        }
    }
    Lanes sum = Lanes::Zero();
    for (std::size_t i = 0; i < kModels; ++i) {
        position_[i].correct(ahead[i], ahead[i].innovation(sample.position));
        sum += ahead[i].x.sum();
    }
    if (!update_rotations(sample, dt) || !std::isfinite(sum.sum())) return start(sample);
    for (std::size_t i = 0; i < kModels; ++i) position_[i].accept(ahead[i]);
    clock_.advance(sample.t_s);
    select(sample);
    remember();
    return SampleStatus::accepted;
}

bool ModelBank::update_rotations(const PoseSample& sample, double dt) noexcept {
    if (!sample.has_orientation && !rotation_[0].has_started()) return true;
    bool finite = true;
    for (RotationFilter& rotation : rotation_) {
        rotation.propagate(dt);
        if (sample.has_orientation) rotation.correct(sample.orientation);
        finite = finite && rotation.is_finite();
    }
    return finite;
}

void ModelBank::remember() noexcept {
    newest_ = (newest_ + 1) % kHistory;
    times_s_[newest_] = clock_.time_s();
    for (std::size_t i = 0; i < kModels; ++i) states_[newest_][i] = position_[i].now().x;
    if (score_ == BankScore::likelihood)
        for (std::size_t i = 0; i < kModels; ++i) covariances_[newest_][i] = position_[i].now().p;
    if (held_ < kHistory) ++held_;
}

double ModelBank::penalty(std::size_t model, std::size_t past, double elapsed,
                          const Lanes& measured) const noexcept {
    const MotionModel& motion = position_[model].model();
    const auto square = [&](const Transition& f) {
        const AxisStates& x = states_[past][model];
        return (measured - (x.p + f.pv * x.v + f.pa * x.a)).matrix().squaredNorm();
    };
    if (score_ == BankScore::distance) return square(motion.transition(elapsed));
    const MotionStep step = motion.step(elapsed);
    const double variance = propagated(covariances_[past][model], step).pp + motion.measurement_variance;
    return square(step.f) / variance + 3 * std::log(variance);  // -2 log (3.27), its constant left out
}

void ModelBank::select(const PoseSample& sample) noexcept {
    // The entry nearest to one lead ago; from one sample to the next its age changes little.
    const auto miss = [&](std::size_t age) { return std::abs(sample.t_s - times_s_[place(age)] - lead_s_); };
    std::size_t age = std::min(age_ + 1, held_ - 1);
    while (age > 0 && miss(age - 1) < miss(age)) --age;
    while (age + 1 < held_ && miss(age + 1) < miss(age)) ++age;
    age_ = age;
    const std::size_t past = place(age);
    const double elapsed = sample.t_s - times_s_[past];
    const double period = sample.t_s - times_s_[place(0)];
    if (elapsed < lead_s_ - period / 2) return;
    const Lanes measured = to_lanes(sample.position);
    double least = penalty(0, past, elapsed, measured);
    selected_ = 0;
    for (std::size_t i = 1; i < kModels; ++i) {
        const double other = penalty(i, past, elapsed, measured);
        if (other < least) least = other, selected_ = i;
    }
}

PosePrediction ModelBank::predict_model(std::size_t index, double lead_s) const noexcept {
    const AxisStates ahead = position_[index].after(lead_s);
    PosePrediction pose;
    pose.position = ahead.p.head<3>();
    pose.velocity = ahead.v.head<3>();
    rotation_[index].predict(lead_s, pose);
    return pose;
}

std::optional<PoseCovariance> ModelBank::covariance(double lead_s) const noexcept {
    const AxisMatrix<double> ahead = position_[selected_].covariance_after(lead_s);
    return PoseCovariance{ahead.pp * Eigen::Matrix3d::Identity(), ahead.vv * Eigen::Matrix3d::Identity(),
                          rotation_[selected_].variance_after(lead_s) * Eigen::Matrix3d::Identity()};
}

}  // namespace tracking
