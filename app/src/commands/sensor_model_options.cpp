#include "commands/sensor_model_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace app {
namespace {

/// Samples per second; 0: the recording's own times.
ValueFormat<double> rate_or_0() {
    ValueFormat<double> rate = as::number(0.1, 1e5, "Hz");
    rate.expected += " (0: the recording's own times)";
    rate.read = [read = rate.read](const std::string& text) {
        return as::number(0, 0).read(text) ? std::optional(0.0) : read(text);
    };
    return rate;
}

/// Shorter bursts cannot lose that share [samples].
double shortest_burst(double drop_out) {
    constexpr double kDigits = 1e9;  // so that 0.9 allows 9
    return std::max(1.0, std::round(kDigits * drop_out / (1 - drop_out)) / kDigits);
}

}  // namespace

void add_sensor_model_options(Command& command, tracking::SensorModel& s, const std::string& rate_option,
                              Arrivals arrivals) {
    Command sensor = command.under("Simulated sensor");
    const ValueFormat<double> mm = as::number(0, 1000, "mm", 1000), rad = as::number(0, 1, "rad"),
                              share = as::number(0, 1);
    sensor.option(rate_option, s.rate_hz, rate_or_0(),
                  "Sample rate, by linear interpolation; 0: the recording's own times");
    sensor.option("--noise", s.noise_m, mm, "Standard deviation of white position noise, each axis");
    sensor.option("--noise-rad", s.noise_rad, rad,
                  "Standard deviation of white orientation noise, each axis");
    sensor.option("--jitter", s.jitter_s, as::number(0, 1000, "ms", 1000),
                  "Standard deviation of the sampling times");
    sensor.flag("--nominal-stamps", s.true_stamps, "Samples carry nominal times, not the jittered ones",
                false);
    sensor.option("--drop-out", s.drop_out, as::number(0, 0.9), "Share of samples lost, in bursts");
    sensor.option("--burst", s.burst, as::number(1, 1e6, "samples"),
                  "Mean length of these bursts, at least drop-out / (1 - drop-out)");
    sensor.option("--latency", s.latency_s, as::number(0, 10000, "ms", 1000),
                  "Stamps are later than the poses they carry by this");
    sensor.option("--quantum", s.quantum_m, mm, "Positions are multiples of this");
    sensor.option("--quantum-rad", s.quantum_rad, rad, "Rotation vectors are multiples of this");
    sensor.option("--outlier", s.outlier, share,
                  "Share of samples that lie anywhere within --outlier-radius");
    sensor.option("--outlier-radius", s.outlier_m, as::number(0, 1e5, "mm", 1000),
                  "How far outliers lie from the truth, at most");
    if (arrivals == Arrivals::any_order) {
        sensor.option("--duplicate", s.duplicate, share, "Share of samples that arrive twice");
        sensor.option("--late", s.late, as::number(0, 0.5),
                      "Share of samples that arrive after their successor");
    }
    sensor.option("--seed", s.seed, as::whole(0, std::numeric_limits<std::int64_t>::max()),
                  "Seed of all that is random in it");
    command.checks([&s] {
        if (const double least = shortest_burst(s.drop_out); s.burst < least)
            refuse_value("--burst", fmt::format("{}", s.burst),
                         fmt::format("a number from {} to 1000000 with --drop-out {}", least, s.drop_out));
    });
}

}  // namespace app
