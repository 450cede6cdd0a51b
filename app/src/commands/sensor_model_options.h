#pragma once
#include <tracking/sensor.h>

#include "commands/command.h"

namespace app {

/// Whether samples may arrive twice or late: not where they are written to a trace, which is in order.
enum class Arrivals { any_order, in_order };

/// The options of a simulated sensor; `rate_option` names its rate.
void add_sensor_model_options(Command& command, tracking::SensorModel& sensor,
                              const std::string& rate_option = "--rate",
                              Arrivals arrivals = Arrivals::any_order);

}  // namespace app
