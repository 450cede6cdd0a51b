#pragma once
#include <sys/types.h>

#include <string>

#include "sim/simulation.h"

namespace sim {

/// One child process. It gets our environment, /dev/null as standard input and output, our standard error and
/// no other descriptor, a process group of its own (a terminal's Ctrl-C is for the application) and default
/// signal handling. Killed at destruction.
class WorkerProcess {
public:
    WorkerProcess(const WorkerLaunch& launch, const std::string& endpoint);  ///< throws std::runtime_error
    ~WorkerProcess();
    WorkerProcess(WorkerProcess&& other) noexcept;
    WorkerProcess& operator=(WorkerProcess&&) = delete;

    [[nodiscard]] std::uint32_t id() const noexcept { return static_cast<std::uint32_t>(id_); }
    /// True once the process has ended; reaps it. Never blocks.
    [[nodiscard]] bool has_ended() noexcept;
    /// It has ended, by a signal.
    [[nodiscard]] bool was_killed() const noexcept;
    /// How it ended, in words.
    [[nodiscard]] std::string ending() const;
    /// Kills it (also if it is stopped) and waits for its end.
    void kill() noexcept;

private:
    pid_t id_ = -1;
    bool ended_ = false;
    int status_ = 0;
};

}  // namespace sim
