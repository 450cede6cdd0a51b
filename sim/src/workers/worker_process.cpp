#include "workers/worker_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/errors.h"

namespace sim {
namespace {

struct SpawnSettings {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;

    SpawnSettings() {
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
        posix_spawnattr_init(&attributes);
        sigset_t none, all;
        sigemptyset(&none);
        sigfillset(&all);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setsigdefault(&attributes, &all);
        posix_spawnattr_setpgroup(&attributes, 0);
        posix_spawnattr_setflags(&attributes,
                                 POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    }
    ~SpawnSettings() {
        posix_spawn_file_actions_destroy(&files);
        posix_spawnattr_destroy(&attributes);
    }
    SpawnSettings(const SpawnSettings&) = delete;
    SpawnSettings& operator=(const SpawnSettings&) = delete;
};

}  // namespace

WorkerProcess::WorkerProcess(const WorkerLaunch& launch, const std::string& endpoint, const Secret& secret)
    : secret_(secret) {
    std::vector<std::string> words = {launch.program};
    words.insert(words.end(), launch.arguments.begin(), launch.arguments.end());
    words.insert(words.end(), {"--connect", endpoint});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string name = std::string(kSecretVariable) + "=";
    std::string own = name + to_hex(secret);
    std::vector<char*> environment = {own.data()};
    for (char** entry = environ; *entry != nullptr; ++entry)
        if (!std::string_view(*entry).starts_with(name)) environment.push_back(*entry);
    environment.push_back(nullptr);
    const SpawnSettings settings;
    const int error = posix_spawn(&id_, launch.program.c_str(), &settings.files, &settings.attributes,
                                  arguments.data(), environment.data());
    if (error != 0) throw WorkerError("cannot start worker " + launch.program + ": " + std::strerror(error));
}

WorkerProcess::WorkerProcess(WorkerProcess&& other) noexcept
    : secret_(other.secret_),
      id_(std::exchange(other.id_, -1)),
      ended_(other.ended_),
      status_(other.status_) {}

WorkerProcess::~WorkerProcess() {
    kill();
}

bool WorkerProcess::has_ended() noexcept {
    if (!ended_ && id_ > 0) {
        const pid_t found = waitpid(id_, &status_, WNOHANG);
        ended_ = found == id_ || (found < 0 && errno == ECHILD);
    }
    return ended_;
}

bool WorkerProcess::was_killed() const noexcept {
    return ended_ && WIFSIGNALED(status_);
}

std::string WorkerProcess::ending() const {
    if (WIFSIGNALED(status_)) return "ended by signal " + std::to_string(WTERMSIG(status_));
    return "exit status " + std::to_string(WEXITSTATUS(status_));
}

void WorkerProcess::kill() noexcept {
    if (ended_ || id_ <= 0) return;
    ::kill(id_, SIGKILL);
    while (waitpid(id_, &status_, 0) < 0 && errno == EINTR) {
    }
    ended_ = true;
}

}  // namespace sim
