#pragma once
#include "commands/command.h"

namespace app {

/// Makes `program` that of `musicworld bench NAME`: our speed beside peers', and what accuracy costs.
void add_bench_options(Command& program);

}  // namespace app
