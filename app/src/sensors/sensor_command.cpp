#include "sensors/sensor_command.h"

#include <fmt/format.h>

#include <memory>

#include "files/option_values.h"

namespace app {
namespace {

struct SensorArgumentTexts {
    SensorTask task;
    std::string period = "0", stall_at = "-1", stall = "0";
};

void add_source_options(CLI::App& command, SensorArgumentTexts& a) {
    command.add_option("--source", a.task.source.source, "trace:FILE, stdin, zmq:ENDPOINT or osc:PORT")
        ->required();
    command.add_option("--stick", a.task.source.sticks, "Name; once a stick")->required();
    command.add_option("--epoch-ns", a.task.source.epoch_ns, "CLOCK_MONOTONIC at which the run begins [ns]");
    command.add_option("--period", a.period, "A trace begins again that long after it began [s]; 0: never");
    command.add_flag("--resume", a.task.source.resume, "Go on at the current time");
    command.add_option("--stall-at", a.stall_at, "Pause the reader then [s since the epoch]");
    command.add_option("--stall", a.stall, "for that long [s]");
}

void add_process_options(CLI::App& command, SensorTask& task) {
    command.add_option("--picture", task.predictors.picture, "Predictor")->required();
    command.add_option("--sound", task.predictors.sound, "Predictor")->required();
    command.add_option("--confirming", task.predictors.confirming, "Predictor");
    command.add_option("--state-fd", task.state_fds, "Shared memory; once a stick")->required();
    command.add_option("--wake-fd", task.wake_fd, "eventfd")->required();
    command.add_option("--life-fd", task.life_fd, "Pipe that ends with the application")->required();
    command.add_flag("--no-realtime{false}", task.realtime, "Without real-time scheduling");
}

int run(SensorArgumentTexts& a) {
    a.task.source.period_s = parse_number(a.period, "--period");
    a.task.stall_at_s = parse_number(a.stall_at, "--stall-at");
    a.task.stall_s = parse_number(a.stall, "--stall");
    return run_sensor(a.task);
}

}  // namespace

void add_sensor_command(CLI::App& program, int& status) {
    CLI::App* sensor =
        program.add_subcommand("sensor", "Read and filter a stick's samples (started by the program itself)");
    auto a = std::make_shared<SensorArgumentTexts>();
    add_source_options(*sensor, *a);
    add_process_options(*sensor, a->task);
    sensor->callback([a, &status] { status = run(*a); });
}

std::vector<std::string> sensor_arguments(const SensorTask& task) {
    std::vector<std::string> words = {"sensor"};
    const auto add = [&](const char* name, const auto& value) {
        words.push_back(fmt::format("--{}={}", name, value));  // one word: values may begin with '-'
    };
    add("source", task.source.source);
    for (const std::string& stick : task.source.sticks) add("stick", stick);
    add("epoch-ns", task.source.epoch_ns);
    add("period", task.source.period_s);
    add("stall-at", task.stall_at_s);
    add("stall", task.stall_s);
    if (task.source.resume) words.emplace_back("--resume");
    add("picture", task.predictors.picture);
    add("sound", task.predictors.sound);
    if (!task.predictors.confirming.empty()) add("confirming", task.predictors.confirming);
    for (const int descriptor : task.state_fds) add("state-fd", descriptor);
    add("wake-fd", task.wake_fd);
    add("life-fd", task.life_fd);
    if (!task.realtime) words.emplace_back("--no-realtime");
    return words;
}

}  // namespace app
