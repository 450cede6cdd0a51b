#include "traces/sensor_model.h"

#include <fmt/format.h>

#include "files/bad_input.h"

namespace app {
std::string describe(const tracking::SensorModel& sensor) {
    std::string text;
    const auto say = [&](double value, double otherwise, const char* what, const char* unit) {
        if (value != otherwise) text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", what, value, unit);
    };
    say(sensor.rate_hz, 0, "rate", " Hz");
    say(1000 * sensor.noise_m, 0, "noise", " mm");
    say(sensor.noise_rad, 0, "noise", " rad");
    say(1000 * sensor.jitter_s, 0, "jitter", " ms");
    say(sensor.drop_out, 0, "drop-outs", "");
    say(1000 * sensor.latency_s, 0, "latency", " ms");
    say(1000 * sensor.quantum_m, 0, "quantum", " mm");
    say(sensor.quantum_rad, 0, "quantum", " rad");
    say(sensor.outlier, 0, "outliers", "");
    say(sensor.duplicate, 0, "duplicates", "");
    say(sensor.late, 0, "late", "");
    return text.empty() ? text : fmt::format("simulated sensor ({}; seed {})", text, sensor.seed);
}

tracking::Trace seen_by(const tracking::Trace& trace, const tracking::SensorModel& sensor) {
    tracking::Trace seen = trace;
    if (sensor.rate_hz > 0) seen.rate_hz = sensor.rate_hz;
    for (std::size_t i = 0; i < seen.sticks.size(); ++i) {
        tracking::StickTrace& stick = seen.sticks[i];
        stick.samples = tracking::sense(trace, i, sensor);
        if (stick.samples.size() < 2)
            throw BadInput(
                fmt::format("{}: error: found {} samples of stick '{}' after the simulated sensor, expected "
                            "at least two; raise its rate or lower its drop-outs",
                            trace.file, stick.samples.size(), stick.name));
    }
    return seen;
}

}  // namespace app
