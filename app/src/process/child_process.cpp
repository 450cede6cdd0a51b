#include "process/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <tracking/input.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include "files/bad_input.h"
#include "files/file_descriptor.h"
#include "files/option_values.h"

extern char** environ;

namespace app {
namespace fs = std::filesystem;
namespace {

/// What posix_spawn does in the child before it becomes the program.
struct Preparation {
    posix_spawn_file_actions_t files{};
    posix_spawnattr_t attributes{};

    explicit Preparation(bool own_group) {
        posix_spawn_file_actions_init(&files);
        posix_spawnattr_init(&attributes);
        sigset_t none;
        sigemptyset(&none);
        posix_spawnattr_setsigmask(&attributes, &none);  // whatever this thread has blocked
        posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETSIGMASK |
                                                                 (own_group ? POSIX_SPAWN_SETPGROUP : 0)));
    }
    ~Preparation() {
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&files);
    }
    Preparation(const Preparation&) = delete;
    Preparation& operator=(const Preparation&) = delete;
    void become(int descriptor, int of_child) {
        if (descriptor >= 0) posix_spawn_file_actions_adddup2(&files, descriptor, of_child);
    }
};

FileDescriptor opened(const fs::path& file, int flags) {
    FileDescriptor result = open_file(file, flags, 0600);
    if (!result) throw std::runtime_error("error: " + cannot("open " + file.string()));
    return result;
}

std::vector<char*> pointers(const std::vector<std::string>& words) {
    std::vector<char*> result;
    result.reserve(words.size() + 1);
    for (const std::string& word : words) result.push_back(const_cast<char*>(word.c_str()));
    result.push_back(nullptr);
    return result;
}

/// This process's environment with `variables` in the place of its own of these names.
std::vector<std::string> environment_with(const std::vector<std::string>& variables) {
    std::vector<std::string> all = variables;
    for (char** own = environ; *own != nullptr; ++own) {
        const std::string_view entry = *own;
        const auto replaced = [&](const std::string& v) {
            return entry.starts_with(std::string_view(v).substr(0, v.find('=') + 1));
        };
        if (std::none_of(variables.begin(), variables.end(), replaced)) all.emplace_back(entry);
    }
    return all;
}

}  // namespace

fs::path program_beside(const std::string& name) {
    return fs::read_symlink("/proc/self/exe").parent_path() / name;
}

void require_program(const std::string& name, const std::string& purpose) {
    const char* path = std::getenv("PATH");
    const std::vector<std::string> folders = split(path != nullptr ? path : "/bin:/usr/bin", ':');
    const auto has = [&](const std::string& folder) {
        return ::access((fs::path(folder.empty() ? "." : folder) / name).c_str(), X_OK) == 0;
    };
    if (std::ranges::none_of(folders, has))
        throw std::runtime_error(
            fmt::format("error: cannot start {}: not found on PATH, expected it for {}", name, purpose));
}

int start_child(const ChildStart& start) {
    Preparation child_side(start.own_group);
    child_side.become(start.in, STDIN_FILENO);
    child_side.become(start.out, STDOUT_FILENO);
    child_side.become(start.err, STDERR_FILENO);
    for (const int descriptor : start.inherited)
        child_side.become(descriptor, descriptor);  // onto itself: open across exec in the child alone
    const std::vector<char*> arguments = pointers(start.command);
    const std::vector<std::string> variables = environment_with(start.variables);
    const std::vector<char*> environment = pointers(variables);
    pid_t child = 0;
    const int error = posix_spawnp(&child, arguments[0], &child_side.files, &child_side.attributes,
                                   arguments.data(), environment.data());
    if (error != 0) throw std::runtime_error("error: " + cannot("start " + start.command[0], error));
    return child;
}

int wait_for_child(int pid) {
    int status = 0;
    while (waitpid(pid, &status, 0) < 0)
        if (errno != EINTR)
            throw std::runtime_error("error: " + cannot(fmt::format("wait for process {}", pid)));
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void run_child(const std::vector<std::string>& command, const fs::path& log,
               const std::vector<std::string>& variables) {
    const FileDescriptor none = opened("/dev/null", O_RDONLY);
    const FileDescriptor messages = opened(log, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND);
    const int child = start_child({command, variables, none.get(), messages.get(), messages.get(), false});
    const int status = wait_for_child(child);
    if (status == 0) return;
    throw std::runtime_error(fmt::format("error: found {} ended with status {}, expected 0; it said: {}",
                                         command[0], status,
                                         one_line(tracking::read_bytes(log.string(), "what it said"), 400)));
}

}  // namespace app
