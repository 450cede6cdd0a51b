#include "traces/sensor_model_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"
#include "files/option_values.h"

namespace app {
namespace {

double number_within(const std::string& text, const std::string& option, double least, double most) {
    const double value = parse_number(text, option);
    if (value >= least && value <= most) return value;
    throw BadInput(
        fmt::format("error: found {} {}, expected a number from {} to {}", option, text, least, most));
}

/// Shorter bursts cannot lose that share [samples].
double shortest_burst(double drop_out) {
    constexpr double kDigits = 1e9;  // so that 0.9 allows 9
    return std::max(1.0, std::round(kDigits * drop_out / (1 - drop_out)) / kDigits);
}

double rate_of(const SensorArguments& a) {
    const double rate = parse_number(a.rate, a.rate_option);
    if (rate == 0 || (rate >= 0.1 && rate <= 1e5)) return rate;
    throw BadInput(fmt::format("error: found {} {}, expected 0.1 to 100000 Hz (0: the recording's own times)",
                               a.rate_option, a.rate));
}

}  // namespace

std::shared_ptr<SensorArguments> add_sensor_options(CLI::App& command, const std::string& rate_option,
                                                    Arrivals arrivals) {
    auto a = std::make_shared<SensorArguments>();
    a->rate_option = rate_option;
    const auto add = [&](const std::string& name, std::string& value, const std::string& help) {
        command.add_option(name, value, help)->capture_default_str()->group("Simulated sensor");
    };
    add(rate_option, a->rate, "Samples a second, by linear interpolation; 0: the recording's own times");
    add("--noise", a->noise, "Standard deviation of white position noise, each axis [mm]");
    add("--noise-rad", a->noise_rad, "Standard deviation of white orientation noise, each axis [rad]");
    add("--jitter", a->jitter, "Standard deviation of the sampling times [ms]");
    command
        .add_flag("--nominal-stamps", a->nominal_stamps, "Samples carry nominal times, not the jittered ones")
        ->group("Simulated sensor");
    add("--drop-out", a->drop_out, "Share of samples lost, 0 to 0.9, in bursts");
    add("--burst", a->burst, "Mean length of these bursts [samples]");
    add("--latency", a->latency, "Stamps are later than the poses they carry by this [ms]");
    add("--quantum", a->quantum, "Positions are multiples of this [mm]");
    add("--quantum-rad", a->quantum_rad, "Rotation vectors are multiples of this [rad]");
    add("--outlier", a->outlier, "Share of samples that lie anywhere within --outlier-radius");
    add("--outlier-radius", a->outlier_radius, "How far outliers lie from the truth, at most [mm]");
    if (arrivals == Arrivals::any_order) {
        add("--duplicate", a->duplicate, "Share of samples that arrive twice");
        add("--late", a->late, "Share of samples that arrive after their successor, 0 to 0.5");
    }
    command.add_option("--seed", a->seed, "Seed of all that is random in it")
        ->capture_default_str()
        ->group("Simulated sensor");
    return a;
}

tracking::SensorModel sensor_model(const SensorArguments& a) {
    tracking::SensorModel sensor;
    sensor.rate_hz = rate_of(a);
    sensor.jitter_s = number_within(a.jitter, "--jitter", 0, 1000) / 1000;
    sensor.true_stamps = !a.nominal_stamps;
    sensor.drop_out = number_within(a.drop_out, "--drop-out", 0, 0.9);
    sensor.burst = number_within(a.burst, "--burst", shortest_burst(sensor.drop_out), 1e6);
    sensor.noise_m = number_within(a.noise, "--noise", 0, 1000) / 1000;
    sensor.noise_rad = number_within(a.noise_rad, "--noise-rad", 0, 1);
    sensor.quantum_m = number_within(a.quantum, "--quantum", 0, 1000) / 1000;
    sensor.quantum_rad = number_within(a.quantum_rad, "--quantum-rad", 0, 1);
    sensor.outlier = number_within(a.outlier, "--outlier", 0, 1);
    sensor.outlier_m = number_within(a.outlier_radius, "--outlier-radius", 0, 1e5) / 1000;
    sensor.latency_s = number_within(a.latency, "--latency", 0, 10000) / 1000;
    sensor.duplicate = number_within(a.duplicate, "--duplicate", 0, 1);
    sensor.late = number_within(a.late, "--late", 0, 0.5);
    sensor.seed = a.seed;
    return sensor;
}

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
    try {
        for (std::size_t i = 0; i < seen.sticks.size(); ++i)
            seen.sticks[i].samples = tracking::sense(trace.sticks[i], sensor, i);
    } catch (const std::invalid_argument& error) {
        throw BadInput(fmt::format("{}: error: {}", trace.file, error.what()));
    }
    for (const tracking::StickTrace& stick : seen.sticks)
        if (stick.samples.size() < 2)
            throw BadInput(
                fmt::format("{}: error: found {} samples of stick '{}' after the simulated sensor, expected "
                            "at least two; raise "
                            "its rate or lower its drop-outs",
                            trace.file, stick.samples.size(), stick.name));
    return seen;
}

}  // namespace app
