#include "commands/keys_command.h"

#include <fmt/format.h>
#include <sim/distributed_world.h>

#include <memory>

#include "files/comma_list.h"

namespace app {

void add_keys_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand("keys", "Keys for workers on other machines");
    struct Typed {
        std::string folder, workers = "worker";
    };
    auto typed = std::make_shared<Typed>();
    command->add_option("FOLDER", typed->folder, "New folder for the keys")->required();
    command->add_option("--workers", typed->workers, "Names of workers, NAME,...: each gets NAME.key")
        ->capture_default_str();
    command->callback([typed] {
        sim::make_keys(typed->folder, split_at_commas(typed->workers));
        fmt::print("Keys: {0}. Workers need their NAME.key; application.key stays here.\n", typed->folder);
    });
}

void add_worker_command(CLI::App& program, int& status) {
    CLI::App* command = program.add_subcommand("worker", "Join a simulation, from this host or any other");
    auto endpoint = std::make_shared<std::string>(), key = std::make_shared<std::string>();
    command->add_option("--connect", *endpoint, "ZeroMQ endpoint of the application: tcp://ADDRESS:PORT")
        ->required();
    command->add_option("--key", *key, "This worker's key, made by `musicworld keys`");
    command->callback([endpoint, key, &status] { status = sim::run_worker(*endpoint, *key); });
}

}  // namespace app
