#include <fmt/format.h>
#include <sim/distributed_world.h>

#include <filesystem>
#include <limits>
#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/bad_input.h"
#include "sensors/sensor_process.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// Only what an earlier `keys` wrote may be replaced.
void require_keys_alone(const fs::path& folder) {
    std::error_code error;
    if (!fs::exists(folder, error)) return;
    const auto refuse = [&](const std::string& found) {
        throw BadInput(
            fmt::format("{}: error: found {}, expected a new folder, or one with nothing but keys, which "
                        "are replaced; choose another",
                        folder.string(), found));
    };
    if (!fs::is_directory(folder, error)) refuse("a file");
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const fs::path kind = entry.path().extension();
        const bool key = kind == ".key" || kind == ".pub" || entry.path().filename() == "allowed";
        if (!key || !entry.is_regular_file()) refuse(entry.path().filename().string());
    }
}

void make_keys(const fs::path& folder, const std::vector<std::string>& workers) {
    require_keys_alone(folder);
    fs::path partial = (folder.has_filename() ? folder : folder.parent_path());
    partial += ".partial";
    fs::remove_all(partial);
    sim::make_keys(partial, workers);
    fs::remove_all(folder);
    fs::rename(partial, folder);
    fmt::print("Keys: {}. Workers need their NAME.key; application.key stays here.\n", folder.string());
}

void add_keys_command(Command& program) {
    Command command = program.command("keys", "Keys for workers on other machines");
    struct Options {
        std::string folder;
        std::vector<std::string> workers = {"worker"};
    };
    auto o = std::make_shared<Options>();
    command.option("FOLDER", o->folder, as::text("FOLDER"), "Folder for the keys; keys in it are replaced")
        .required();
    command.option("--workers", o->workers, as::list_of(as::text("NAME")),
                   "Names of workers: each gets NAME.key");
    command.runs([o] { make_keys(o->folder, o->workers); });
}

void add_worker_command(Command& program) {
    Command command = program.command("worker", "Join a simulation, from this host or any other");
    struct Options {
        std::string endpoint, key;
    };
    auto o = std::make_shared<Options>();
    command
        .option("--connect", o->endpoint, as::text("ENDPOINT"),
                "ZeroMQ endpoint of the application: tcp://ADDRESS:PORT")
        .required();
    command.option("--key", o->key, as::text("FILE"), "This worker's key, made by `musicworld keys`");
    command.runs([o] { throw ExitStatus{sim::run_worker(o->endpoint, o->key)}; });
}

void add_sensor_command(Command& program) {
    Command command =
        program.command("sensor", "Read and filter a stick's samples (started by the program itself)")
            .hidden();
    auto task = std::make_shared<SensorTask>();
    SourceOptions& source = task->source;
    command
        .option("--source", source.source, as::text("SOURCE"), "trace:FILE, stdin, zmq:ENDPOINT or osc:PORT")
        .required();
    command.options("--stick", source.sticks, as::text("NAME"), "Name; once a stick").required();
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    command.option("--epoch-ns", source.epoch_ns, as::whole(0, kMost, "ns"),
                   "CLOCK_MONOTONIC at which the run begins");
    command.option("--period", source.period_s, as::number(),
                   "A trace begins again that long after it began [s]; 0: never");
    command.flag("--resume", source.resume, "Go on at the current time");
    command.option("--stall-at", task->stall_at_s, as::number(), "Pause the reader then [s since the epoch]");
    command.option("--stall", task->stall_s, as::number(), "for that long [s]");
    const auto predictor = as::text("PREDICTOR");
    command.option("--picture", task->predictors.picture, predictor, "Of pictures").required();
    command.option("--sound", task->predictors.sound, predictor, "Of sound").required();
    command.option("--confirming", task->predictors.confirming, predictor,
                   "Of contacts, for a second opinion");
    command.option("--sound-lead", task->predictors.sound_lead_s, as::number(),
                   "Contacts are looked for so far ahead [s]");
    const auto descriptor = as::whole(0, std::numeric_limits<int>::max());
    command.options("--state-fd", task->state_fds, descriptor, "Shared memory; once a stick").required();
    command.option("--wake-fd", task->wake_fd, descriptor, "eventfd").required();
    command.option("--life-fd", task->life_fd, descriptor, "Pipe that ends with the application").required();
    command.flag("--no-realtime", task->realtime, "Without real-time scheduling", false);
    command.runs([task] { throw ExitStatus{run_sensor(*task)}; });
}

}  // namespace

void add_worker_commands(Command& program) {
    add_keys_command(program);
    add_worker_command(program);
    add_sensor_command(program);
}

}  // namespace app
