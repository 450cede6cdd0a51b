#include "filter/interacting_models.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tracking {
namespace {

constexpr double kMostSteps = 64;  // within a lead

AxisMatrix<double> times(const AxisMatrix<double>& q, double density) {
    return {density * q.pp, density * q.pv, density * q.pa, density * q.vv, density * q.va, density * q.aa};
}

/// sum += weight (p + d d^T).
void add_spread(AxisMatrix<Lanes>& sum, double weight, const AxisMatrix<Lanes>& p, const AxisStates& d) {
    sum.pp += weight * (p.pp + d.p * d.p);
    sum.pv += weight * (p.pv + d.p * d.v);
    sum.pa += weight * (p.pa + d.p * d.a);
    sum.vv += weight * (p.vv + d.v * d.v);
    sum.va += weight * (p.va + d.v * d.a);
    sum.aa += weight * (p.aa + d.a * d.a);
}

void add_weighted(AxisStates& sum, double weight, const AxisStates& x) {
    sum.p += weight * x.p;
    sum.v += weight * x.v;
    sum.a += weight * x.a;
}

AxisStates minus(const AxisStates& a, const AxisStates& b) {
    return {a.p - b.p, a.v - b.v, a.a - b.a};
}

AxisMatrix<Lanes> zero_lanes() {
    const Lanes zero = Lanes::Zero();
    return {zero, zero, zero, zero, zero, zero};
}

AxisMatrix<Lanes> in_lanes(const AxisMatrix<double>& p) {
    return {Lanes::Constant(p.pp), Lanes::Constant(p.pv), Lanes::Constant(p.pa),
            Lanes::Constant(p.vv), Lanes::Constant(p.va), Lanes::Constant(p.aa)};
}

}  // namespace

InteractingModels::InteractingModels(const Options& options)
    : gate_(OutlierGate::of_positions(options.gate_sigmas)),
      rotation_({MotionModel::Singer{options.alpha, options.density[1]}, options.measurement_variance,
                 options.initial_variance},
                options.gate_sigmas),
      options_(options),
      unit_{MotionModel::Singer{options.alpha, 1}, options.measurement_variance, options.initial_variance} {}

SampleStatus InteractingModels::correct(const PoseSample& sample) noexcept {
    return clock_.take(
        sample, [this](const PoseSample& first) { return start(first); },
        [this](const PoseSample& next) { return update(next); });
}

SampleStatus InteractingModels::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    gate_.restart(sample.position);
    rotation_.start(sample);
    mean_ = {to_lanes(sample.position), Lanes::Zero(), Lanes::Zero()};
    period_ = 0;
    for (std::size_t j = 0; j < kModes; ++j) {
        modes_.mode[j] = {mean_, in_lanes(unit_.initial_covariance())};
        modes_.mu[j] = 1.0 / kModes;
    }
    return SampleStatus::reinitialised;
}

InteractingModels::Modes InteractingModels::mixed(double dt) const noexcept {
    const double stay = std::exp(-options_.switching_rate * dt);
    const double leave = (1 - stay) / (kModes - 1);
    Modes out;
    for (std::size_t j = 0; j < kModes; ++j) {
        Probabilities w{};
        for (std::size_t i = 0; i < kModes; ++i) {
            w[i] = (i == j ? stay : leave) * modes_.mu[i];
            out.mu[j] += w[i];
        }
        Mode& mode = out.mode[j];
        mode.p = zero_lanes();
        for (std::size_t i = 0; i < kModes; ++i) add_weighted(mode.x, w[i] /= out.mu[j], modes_.mode[i].x);
        for (std::size_t i = 0; i < kModes; ++i)
            add_spread(mode.p, w[i], modes_.mode[i].p, minus(modes_.mode[i].x, mode.x));
    }
    return out;
}

void InteractingModels::correct_modes(Modes& modes, const Eigen::Vector3d& measured) const noexcept {
    Probabilities log_likelihood{};
    for (std::size_t j = 0; j < kModes; ++j) {
        Mode& mode = modes.mode[j];
        const Lanes innovation = to_lanes(measured) - mode.x.p;
        const Lanes variance = mode.p.pp + options_.measurement_variance;
        log_likelihood[j] = -0.5 * ((innovation * innovation / variance).head<3>().sum() +
                                    std::log(variance[0] * variance[1] * variance[2]));
        add(mode.x, tracking::correct(mode.p, options_.measurement_variance), innovation);
    }
    const double best = *std::max_element(log_likelihood.begin(), log_likelihood.end());
    double sum = 0;
    for (std::size_t j = 0; j < kModes; ++j) sum += modes.mu[j] *= std::exp(log_likelihood[j] - best);
    double floored = 0;
    for (double& mu : modes.mu) floored += mu = std::max(mu / sum, kLeastProbability);
    for (double& mu : modes.mu) mu /= floored;
}

AxisStates InteractingModels::mean_of(const Modes& modes) noexcept {
    AxisStates mean;
    for (std::size_t j = 0; j < kModes; ++j) add_weighted(mean, modes.mu[j], modes.mode[j].x);
    return mean;
}

SampleStatus InteractingModels::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    Modes ahead = mixed(dt);
    const MotionStep unit = unit_.step(dt);
    for (std::size_t j = 0; j < kModes; ++j) {
        Mode& mode = ahead.mode[j];
        mode.x = unit.f * mode.x;
        mode.p = propagated(mode.p, unit.f, times(unit.q, options_.density[j]));
    }
    if (gate_.is_on()) {
        const Lanes innovation = to_lanes(sample.position) - mean_of(ahead).p;
        const double variance = ahead.mode.back().p.pp.head<3>().maxCoeff() + options_.measurement_variance;
        const OutlierGate::Verdict verdict =
            gate_.judge(sample.position, dt, innovation.matrix().squaredNorm(), variance);
        if (verdict == OutlierGate::Verdict::refuse) return SampleStatus::outlier;
        if (verdict == OutlierGate::Verdict::persists) return start(sample);
    }
    correct_modes(ahead, sample.position);
    const AxisStates mean = mean_of(ahead);
    rotation_.update(sample, dt);
    if (!mean.is_finite() || !rotation_.is_finite()) return start(sample);
    modes_ = ahead;
    mean_ = mean;
    period_ = dt;
    clock_.advance(sample.t_s);
    return SampleStatus::accepted;
}

PosePrediction InteractingModels::predict(double lead_s) const noexcept {
    const AxisStates ahead = unit_.transition(lead_s) * mean_;
    return rotation_.pose(ahead, lead_s);
}

InteractingModels::Probabilities InteractingModels::switched(const Probabilities& mu,
                                                             double dt) const noexcept {
    const double stay = std::exp(-options_.switching_rate * dt);
    const double leave = (1 - stay) / (kModes - 1);
    const double sum = std::accumulate(mu.begin(), mu.end(), 0.0);
    Probabilities next{};
    for (std::size_t j = 0; j < kModes; ++j) next[j] = stay * mu[j] + leave * (sum - mu[j]);
    return next;
}

AxisMatrix<Lanes> InteractingModels::mixture() const noexcept {
    AxisMatrix<Lanes> spread = zero_lanes();
    for (std::size_t j = 0; j < kModes; ++j)
        add_spread(spread, modes_.mu[j], modes_.mode[j].p, minus(modes_.mode[j].x, mean_));
    return spread;
}

std::optional<PoseCovariance> InteractingModels::covariance(double lead_s) const noexcept {
    // Mixing changes neither mean nor covariance of the whole, and the modes differ in their noise only: what
    // matters is the density expected in each step.
    const double steps = period_ > 0 ? std::clamp(std::round(lead_s / period_), 1.0, kMostSteps) : 1;
    const double dt = lead_s / steps;
    const MotionStep unit = unit_.step(dt);
    AxisMatrix<Lanes> spread = mixture();
    Probabilities mu = modes_.mu;
    for (int i = 0; i < static_cast<int>(steps); ++i) {
        mu = switched(mu, dt);
        const double density = std::inner_product(mu.begin(), mu.end(), options_.density.begin(), 0.0);
        spread = propagated(spread, unit.f, times(unit.q, density));
    }
    PoseCovariance covariance;
    covariance.position.diagonal() = spread.pp.head<3>();
    covariance.velocity.diagonal() = spread.vv.head<3>();
    covariance.rotation = rotation_.variance_after(lead_s) * Eigen::Matrix3d::Identity();
    return covariance;
}

}  // namespace tracking
