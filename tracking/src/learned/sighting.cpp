#include "learned/sighting.h"

#include <cmath>

#include "trace/random_stream.h"

namespace tracking {

Sighting random_sighting(std::uint64_t seed, bool plain) {
    constexpr double kUsualHz = 60, kLeastHz = 30, kMostHz = 150, kTiltRad = 0.15, kUsualShare = 0.4;
    RandomStream random(seed);
    const auto factor = [&](double range) { return std::exp(range * (random.uniform() - 0.5)); };
    Sighting s;
    s.sensor.seed = seed;
    s.sensor.noise_m = 0.25e-3;
    s.sensor.rate_hz = kUsualHz * factor(0.06);  // any phase of the recording
    s.orientation = random.uniform() > 0.3;
    if (plain) return s;
    if (random.uniform() > kUsualShare) {
        s.sensor.rate_hz = kLeastHz * std::exp(random.uniform() * std::log(kMostHz / kLeastHz));
        if (random.uniform() < 0.5) s.sensor.jitter_s = 0.004 * random.uniform();
        if (random.uniform() < 0.5) s.sensor.drop_out = 0.15 * random.uniform();
    }
    s.slower = factor(1.2);
    s.greater = factor(0.8);
    s.taller = factor(0.4);
    const Eigen::Vector3d turn = kTiltRad * Eigen::Vector3d(random.normal(), 0, random.normal());
    s.tilt = Eigen::Quaterniond(
        Eigen::AngleAxisd(turn.norm(), (turn + 1e-12 * Eigen::Vector3d::UnitX()).normalized()));
    return s;
}

StickTrace Sighting::seen(StickTrace stick) const {
    const Eigen::Vector3d origin = stick.samples.front().position, size(greater, greater * taller, greater);
    for (PoseSample& sample : stick.samples) {
        sample.t_s *= slower;
        sample.position = origin + tilt * size.cwiseProduct(sample.position - origin);
        sample.orientation = tilt * sample.orientation;
    }
    return stick;
}

}  // namespace tracking
