#pragma once
#include <tracking/sensor.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace app {

/// A simulated sensor as said on a command line: texts, so that each is checked and named when it is bad.
struct SensorArguments {
    std::string rate_option = "--rate";  ///< how this command calls the rate
    std::string rate = "0", jitter = "0", drop_out = "0", burst = "3", noise = "0", noise_rad = "0",
                quantum = "0", quantum_rad = "0", outlier = "0", outlier_radius = "500", latency = "0",
                duplicate = "0", late = "0";
    bool nominal_stamps = false;
    std::uint64_t seed = 1;
};

/// Whether samples may arrive twice or late: not where they are written to a trace, which is in order.
enum class Arrivals { any_order, in_order };

/// Adds the options of a simulated sensor to a command: `rate_option` HZ, --noise MM, --noise-rad, --jitter
/// MS,
/// --nominal-stamps, --drop-out, --burst, --latency MS, --quantum MM, --quantum-rad, --outlier,
/// --outlier-radius MM, --duplicate, --late, --seed. Read the result in the command's callback.
[[nodiscard]] std::shared_ptr<SensorArguments> add_sensor_options(CLI::App& command,
                                                                  const std::string& rate_option = "--rate",
                                                                  Arrivals arrivals = Arrivals::any_order);

/// The sensor that the options describe. Throws BadInput naming the option.
[[nodiscard]] tracking::SensorModel sensor_model(const SensorArguments& arguments);

/// What the sensor reports of every stick of a trace, in the order of arrival (see tracking::sense); keys as
/// in the trace, except `rate_hz`, which becomes the sensor's where it has one. Throws BadInput for a stick
/// of which fewer than two samples are left, or too many asked.
[[nodiscard]] tracking::Trace seen_by(const tracking::Trace& trace, const tracking::SensorModel& sensor);

/// What a sensor does to a trace, in words, for a trace's source; empty for one that does nothing.
[[nodiscard]] std::string describe(const tracking::SensorModel& sensor);

}  // namespace app
