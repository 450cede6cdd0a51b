#pragma once
#include <sys/types.h>

#include <string>

#include "messages/secret.h"
#include "sim/simulation.h"

namespace sim {

/// The environment's variable from which a worker takes its secret; where there is none it makes one.
inline constexpr const char* kSecretVariable = "MUSICWORLD_WORKER_SECRET";

/// One child process. It gets our environment and its secret in it (which other users cannot read), /dev/null as standard input and output, our standard error and
/// no other descriptor, a process group of its own (a terminal's Ctrl-C is for the application) and default
/// signal handling. Killed at destruction.
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
    /// True once the process has ended; reaps it. Never blocks.
    [[nodiscard]] bool has_ended() noexcept;
    /// It has ended, by a signal.
    [[nodiscard]] bool was_killed() const noexcept;
    /// How it ended, in words.
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
