#include <fmt/format.h>
#include <sim/distributed_world.h>

#include <filesystem>
#include <limits>
#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/bad_input.h"
#include "files/output_file.h"
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
    const fs::path place = output_place(folder.has_filename() ? folder : folder.parent_path()).path;
    const fs::path partial = place.string() + ".partial";
    fs::remove_all(partial);
    sim::make_keys(partial, workers);
    const fs::path old = place.string() + ".old";
    if (fs::exists(place)) fs::rename(place, old);
    put_in_place(partial, place);
    fs::remove_all(old);
    fmt::print("Keys: {}. Workers need their NAME.key; application.key stays here.\n", folder.string());
}

void add_keys_command(Command& program) {
    Command command = program.command("keys", "Keys for workers on other machines");
    struct Options {
        std::string folder;
        std::vector<std::string> workers = {"worker"};
    };
    auto o = std::make_shared<Options>();
    command.required("FOLDER", o->folder, as::text("FOLDER"), "Folder for the keys; keys in it are replaced");
    command.option("--workers", o->workers, as::list_of(as::text("NAME")),
                   "Names of workers: each gets NAME.key");
    command.runs([o] { make_keys(o->folder, o->workers); });
}

void add_worker_command(Command& program) {
    Command command = program.command("worker", "Join a simulation, from this host or any other");
    struct Options {
        std::string endpoint, key;
        int threads = 1;
    };
    auto o = std::make_shared<Options>();
    command.required("--connect", o->endpoint, as::text("ENDPOINT"),
                     "ZeroMQ endpoint of the application: tcp://ADDRESS:PORT");
    command.option("--key", o->key, as::text("FILE"), "This worker's key, made by `musicworld keys`");
    command.option("--threads", o->threads, as::whole(1, kMostThreads),
                   "Threads that share out each of its steps of a simulation");
    command.runs([o] { throw ExitStatus{sim::run_worker(o->endpoint, o->key, o->threads)}; });
}

void add_sensor_command(Command& program) {
    Command command =
        program.command("sensor", "Read and filter a stick's samples (started by the program itself)");
    command->group("");
    auto task = std::make_shared<SensorTask>();
    for_each_sensor_option(*task, [&](const char* name, auto& value, const char* help) {
        using Value = std::decay_t<decltype(value)>;
        const auto whole =
            as::whole(-1, std::numeric_limits<std::int64_t>::max());  // of a descriptor -1: none
        if constexpr (std::is_same_v<Value, std::vector<std::string>>)
            command.options(name, value, as::text("TEXT"), help)->required();
        else if constexpr (std::is_same_v<Value, std::vector<int>>)
            command.options(name, value, whole, help)->required();
        else if constexpr (std::is_same_v<Value, std::string>)
            command.option(name, value, as::text("TEXT"), help);
        else if constexpr (std::is_same_v<Value, bool>)
            command.option(name, value, as::choice<bool>({{"false", false}, {"true", true}}), help);
        else if constexpr (std::is_floating_point_v<Value>)
            command.option(name, value, as::number(), help);
        else
            command.option(name, value, whole, help);
    });
    command.runs([task] { throw ExitStatus{run_sensor(*task)}; });
}

}  // namespace

void add_worker_commands(Command& program) {
    add_keys_command(program);
    add_worker_command(program);
    add_sensor_command(program);
}

}  // namespace app
