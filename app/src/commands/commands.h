#pragma once

namespace app {

class Command;

constexpr int kMostThreads = 256;  ///< that share out a step

// Each adds a command to the program.
void add_bench_command(Command& program);  ///< becomes musicworld_bench, a program beside this one
void add_compare_command(Command& program);
void add_kit_command(Command& program);
void add_modes_command(Command& program);
void add_predict_command(Command& program);
void add_record_command(Command& program);
void add_schema_command(Command& program);
void add_simulate_command(Command& program);
void add_trace_command(Command& program);
void add_train_command(Command& program);
void add_convert_command(Command& trace);  ///< below `trace`
/// Adds `keys`, `worker`, which joins a simulation, and the hidden `sensor`, which the program itself starts.
void add_worker_commands(Command& program);

}  // namespace app
