#pragma once
#include <sys/types.h>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "messages/secret.h"
#include "workers/curve_keys.h"

namespace sim {

/// Connects a worker's DEALER socket to the application; `keys` for CURVE, linger [ms].
[[nodiscard]] zmq::socket_t connect_worker(zmq::context_t& context, const std::string& endpoint,
                                           const std::optional<WorkerKeys>& keys, int linger_ms);

/// Sends a worker's heartbeats from a thread of its own, so that a long step does not look like a failure. It
/// also detects the application's end: on the same machine (ipc) the end of its process; otherwise 1.5 s
/// without an answer to a heartbeat, once the worker is a member.
class Heartbeat {
public:
    /// `secret`: proves to the application that the heartbeats are this worker's.
    Heartbeat(zmq::context_t& context, const std::string& endpoint, const std::optional<WorkerKeys>& keys,
              const Secret& secret);

    /// From now on the heartbeats are those of this member. If this process still runs 0.4 s after the
    /// application's end, it is ended.
    void joined(std::uint32_t worker) noexcept { worker_ = worker; }
    [[nodiscard]] bool application_gone() const noexcept { return gone_; }  ///< once true, it stays true

private:
    void beat(zmq::context_t& context, const std::optional<WorkerKeys>& keys, const std::stop_token& stop);
    void send_beat(zmq::socket_t& socket) const;
    [[nodiscard]] bool application_process_ended() const noexcept;

    static constexpr std::int64_t kNoMember = -1;
    const std::string endpoint_;
    const Secret secret_;
    const pid_t application_;  ///< 0: not known
    const bool child_;         ///< of the application
    std::atomic<std::int64_t> worker_ = kNoMember;
    std::atomic<bool> gone_ = false;
    // Last member: it starts after the others exist and joins before they are destroyed.
    std::jthread thread_;
};

}  // namespace sim
