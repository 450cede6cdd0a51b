#pragma once
#include <sys/types.h>

#include <string>

#include "messages/secret.h"
#include "sim/simulation.h"

namespace sim {

/// Name of the environment variable with a worker's secret. Without it the worker makes a secret of its own.
inline constexpr const char* kSecretVariable = "MUSICWORLD_WORKER_SECRET";

/// One child process, which the destructor kills. It gets:
/// - this process's environment with its secret, which other users cannot read;
/// - /dev/null as standard input and output, this process's standard error, no other descriptor;
/// - a process group of its own, so that a terminal's Ctrl-C is for the application alone;
/// - default signal handling.
class WorkerProcess {
public:
    /// Throws std::runtime_error.
    WorkerProcess(const WorkerLaunch& launch, const std::string& endpoint,
                  const Secret& secret = make_secret());
    ~WorkerProcess();
    WorkerProcess(WorkerProcess&& other) noexcept;
    WorkerProcess& operator=(WorkerProcess&&) = delete;

    [[nodiscard]] std::uint32_t id() const noexcept { return static_cast<std::uint32_t>(id_); }
    [[nodiscard]] const Secret& secret() const noexcept { return secret_; }
    /// Whether the process has ended. Reaps it; never blocks.
    [[nodiscard]] bool has_ended() noexcept;
    /// Whether a signal ended it.
    [[nodiscard]] bool was_killed() const noexcept;
    /// Its exit status or signal, in words.
    [[nodiscard]] std::string ending() const;
    /// Kills it (also if it is stopped) and waits for its end.
    void kill() noexcept;

private:
    Secret secret_;
    pid_t id_ = -1;
    bool ended_ = false;
    int status_ = 0;
};

}  // namespace sim
