#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// The program of this name in the folder of the running one. It need not exist.
[[nodiscard]] std::filesystem::path program_beside(const std::string& name);

/// How a child process is started.
struct ChildStart {
    std::vector<std::string> command;    ///< a program found on PATH, and its arguments
    std::vector<std::string> variables;  ///< NAME=VALUE, in place of this process's own
    int in = -1, out = -1, err = -1;     ///< descriptors that become the child's 0, 1, 2
    bool own_group = false;              ///< so that kill(-pid) reaches what the child starts, too
    std::vector<int> inherited = {};     ///< descriptors that the child keeps, by the same numbers
};

/// Starts it and returns its process id. Throws std::runtime_error (what is missing) when that fails.
[[nodiscard]] int start_child(const ChildStart& start);

/// Throws std::runtime_error "error: cannot start NAME: not found on PATH, expected it for PURPOSE" where there is
/// no such program.
void require_program(const std::string& name, const std::string& purpose);

/// Waits for a child; returns its exit status, or 128 + the signal that ended it.
int wait_for_child(int pid);

/// Runs a program to its end, without input and with its output in `log`. Throws std::runtime_error (what was
/// run, how it ended, how `log` begins) unless it exits with 0.
void run_child(const std::vector<std::string>& command, const std::filesystem::path& log,
               const std::vector<std::string>& variables = {});

}  // namespace app
