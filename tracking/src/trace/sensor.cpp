#include "tracking/sensor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "trace/parameter_check.h"
#include "trace/random_stream.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kLongestShift = 0.45;  // of a period: neighbours that shift towards each other stay apart
constexpr double kMostSamples = 2e7;    // of a stick

constexpr ParameterCheck kSensor{"sensor"};

/// Each fault's own random numbers. Every sample takes the same number from each, whether the fault is on
/// or not, so that the k-th sample's draws depend on k alone.
struct Streams {
    Streams(std::uint64_t seed, std::size_t stick)
        : jitter(mixed_seed(seed, stick, 1)),
          drop_out(mixed_seed(seed, stick, 2)),
          position(mixed_seed(seed, stick, 3)),
          rotation(mixed_seed(seed, stick, 4)),
          outlier(mixed_seed(seed, stick, 5)),
          duplicate(mixed_seed(seed, stick, 6)),
          late(mixed_seed(seed, stick, 7)) {}
    RandomStream jitter, drop_out, position, rotation, outlier, duplicate, late;
};

/// Two states, received and lost: lost ends with probability 1/burst, and begins with the probability that
/// makes `share` the share of lost samples in the long run; so does the first sample's.
class DropOuts {
public:
    DropOuts(double share, double burst)
        : share_(share), begin_(share / (1 - share) / burst), end_(1 / burst) {}

    bool lost(double uniform) {
        const double probability = first_ ? share_ : lost_ ? 1 - end_ : begin_;
        first_ = false;
        return lost_ = uniform <= probability && probability > 0;
    }

private:
    double share_, begin_, end_;
    bool first_ = true, lost_ = false;
};

/// Nominal times and how far each may shift.
struct Schedule {
    std::vector<double> t_s;
    std::vector<double> reach_s;
};

Schedule uniform_schedule(const StickTrace& stick, double rate_hz) {
    const double t0 = stick.samples.front().t_s, t_end = stick.samples.back().t_s;
    const double count =
        std::floor((t_end - t0) * rate_hz * (1 + 1e-12)) + 1;  // the last one despite rounding
    kSensor.require(count <= kMostSamples, std::to_string(count) + " samples of stick '" + stick.name + "'",
                    "at most 20000000; lower the rate");
    Schedule schedule;
    schedule.t_s.reserve(static_cast<std::size_t>(count));
    for (double k = 0; k < count; ++k) schedule.t_s.push_back(std::min(t0 + k / rate_hz, t_end));
    schedule.reach_s.assign(schedule.t_s.size(), kLongestShift / rate_hz);
    return schedule;
}

Schedule own_schedule(const StickTrace& stick) {
    Schedule schedule;
    const std::vector<PoseSample>& samples = stick.samples;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        double step = kGapS;
        if (i > 0) step = std::min(step, samples[i].t_s - samples[i - 1].t_s);
        if (i + 1 < samples.size()) step = std::min(step, samples[i + 1].t_s - samples[i].t_s);
        schedule.t_s.push_back(samples[i].t_s);
        schedule.reach_s.push_back(kLongestShift * step);
    }
    return schedule;
}

double nearest_multiple(double value, double quantum) {
    return quantum > 0 ? quantum * std::round(value / quantum) : value;
}

Eigen::Vector3d nearest_multiple(const Eigen::Vector3d& v, double quantum) {
    return v.unaryExpr([quantum](double x) { return nearest_multiple(x, quantum); });
}

void quantise(PoseSample& sample, const SensorModel& sensor) {
    sample.position = nearest_multiple(sample.position, sensor.quantum_m);
    if (!(sensor.quantum_rad > 0)) return;
    const Eigen::Quaterniond rounded =
        exponential(nearest_multiple(logarithm(sample.orientation), sensor.quantum_rad));
    const double sign = rounded.dot(sample.orientation) < 0 ? -1 : 1;  // the double cover's sheet stays
    sample.orientation.coeffs() = sign * rounded.coeffs();
}

/// A point of the ball of `radius` about `centre`, each volume equally likely.
Eigen::Vector3d in_ball(const Eigen::Vector3d& centre, double radius, RandomStream& random) {
    const Eigen::Vector3d direction = random.normal_vector(1).stableNormalized();
    return centre + radius * std::cbrt(random.uniform()) * direction;
}

/// One sensor's view of one stick, sample by sample.
class Sensing {
public:
    Sensing(const StickTrace& stick, const SensorModel& sensor, std::size_t stick_index)
        : stick_(stick),
          sensor_(sensor),
          random_(sensor.seed, stick_index),
          drop_outs_(sensor.drop_out, sensor.burst) {}

    std::vector<PoseSample> all() {
        const Schedule schedule =
            sensor_.rate_hz > 0 ? uniform_schedule(stick_, sensor_.rate_hz) : own_schedule(stick_);
        for (std::size_t k = 0; k < schedule.t_s.size(); ++k) take(schedule.t_s[k], schedule.reach_s[k]);
        arrive_held();
        return std::move(arrived_);
    }

private:
    void take(double nominal, double reach) {
        const double shift = std::clamp(sensor_.jitter_s * random_.jitter.normal(), -reach, reach);
        const double t = std::clamp(nominal + shift, stick_.samples.front().t_s, stick_.samples.back().t_s);
        const bool lost = drop_outs_.lost(random_.drop_out.uniform());
        std::optional<PoseSample> sample = pose_at(stick_, t);
        const Eigen::Vector3d true_position = sample ? sample->position : Eigen::Vector3d::Zero();
        PoseSample seen = sample.value_or(PoseSample{});
        add_noise(seen);
        quantise(seen, sensor_);
        const bool out = random_.outlier.uniform() <= sensor_.outlier && sensor_.outlier > 0;
        const Eigen::Vector3d elsewhere = in_ball(true_position, sensor_.outlier_m, random_.outlier);
        if (out) seen.position = elsewhere;
        seen.t_s = (sensor_.true_stamps ? t : nominal) + sensor_.latency_s;
        const bool twice = random_.duplicate.uniform() <= sensor_.duplicate && sensor_.duplicate > 0;
        const double late = random_.late.uniform();
        if (sample && !lost) send(seen, twice ? 2 : 1, late);
    }

    void add_noise(PoseSample& sample) {
        sample.position += random_.position.normal_vector(sensor_.noise_m);
        const Eigen::Vector3d turn = random_.rotation.normal_vector(sensor_.noise_rad);
        if (sensor_.noise_rad > 0) sample.orientation = (exponential(turn) * sample.orientation).normalized();
    }

    /// A late sample waits for the next one, which is never late itself: l / (1 - l) of those that may be
    /// late are the share l of all.
    void send(const PoseSample& sample, int copies, double late) {
        const double share = sensor_.late / (1 - sensor_.late);
        if (held_copies_ == 0 && share > 0 && late <= share) {
            held_ = sample;
            held_copies_ = copies;
            return;
        }
        for (; copies > 0; --copies) arrived_.push_back(sample);
        arrive_held();
    }

    void arrive_held() {
        for (; held_copies_ > 0; --held_copies_) arrived_.push_back(held_);
    }

    const StickTrace& stick_;
    const SensorModel& sensor_;
    Streams random_;
    DropOuts drop_outs_;
    PoseSample held_;
    int held_copies_ = 0;
    std::vector<PoseSample> arrived_;
};

}  // namespace

void SensorModel::check() const {
    if (rate_hz != 0) kSensor.require_within(rate_hz, 0.1, 1e5, "rate_hz");
    kSensor.require_within(jitter_s, 0, 1, "jitter_s");
    kSensor.require_within(drop_out, 0, 0.9, "drop_out");
    kSensor.require_within(burst, 1, 1e6, "burst");
    kSensor.require(
        drop_out / (1 - drop_out) <= burst * (1 + 1e-12),
        "drop_out " + std::to_string(drop_out) + " in bursts of " + std::to_string(burst),
        "bursts of at least drop_out / (1 - drop_out) = " + std::to_string(drop_out / (1 - drop_out)));
    kSensor.require_within(noise_m, 0, 1, "noise_m");
    kSensor.require_within(noise_rad, 0, 1, "noise_rad");
    kSensor.require_within(quantum_m, 0, 1, "quantum_m");
    kSensor.require_within(quantum_rad, 0, 1, "quantum_rad");
    kSensor.require_within(outlier, 0, 1, "outlier");
    kSensor.require_within(outlier_m, 0, 100, "outlier_m");
    kSensor.require_within(latency_s, 0, 10, "latency_s");
    kSensor.require_within(duplicate, 0, 1, "duplicate");
    kSensor.require_within(late, 0, 0.5, "late");
}

std::optional<PoseSample> pose_at(const StickTrace& stick, double t_s) {
    const std::vector<PoseSample>& samples = stick.samples;
    const auto after = std::lower_bound(samples.begin(), samples.end(), t_s,
                                        [](const PoseSample& sample, double t) { return sample.t_s < t; });
    if (after == samples.end()) return std::nullopt;
    if (after->t_s == t_s) return *after;
    if (after == samples.begin() || std::isnan(t_s)) return std::nullopt;
    const PoseSample& a = *(after - 1);
    const PoseSample& b = *after;
    if (b.t_s - a.t_s > kGapS) return std::nullopt;
    const double share = (t_s - a.t_s) / (b.t_s - a.t_s);
    PoseSample between = a;
    between.t_s = t_s;
    between.position += share * (b.position - a.position);
    between.has_orientation = a.has_orientation && b.has_orientation;
    if (between.has_orientation) between.orientation = a.orientation.slerp(share, b.orientation).normalized();
    return between;
}

std::vector<PoseSample> sense(const StickTrace& stick, const SensorModel& sensor, std::size_t stick_index) {
    sensor.check();
    if (stick.samples.empty()) return {};
    return Sensing(stick, sensor, stick_index).all();
}

std::vector<PoseSample> sense(const Trace& trace, std::size_t index, const SensorModel& sensor) {
    try {
        return sense(trace.sticks[index], sensor, index);
    } catch (const std::invalid_argument& wrong) {
        throw TraceError(trace.file + ": error: " + wrong.what());
    }
}

}  // namespace tracking
