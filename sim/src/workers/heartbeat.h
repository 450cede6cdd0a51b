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

/// Sends a worker's heartbeats from a thread of its own, so that a long step is not taken for a failure, and
/// detects the application's end. On the same machine (ipc) that is the end of its process; otherwise, once
/// a member, 1.5 s without an answer to a heartbeat.
class Pulse {
public:
    /// `secret`: by which the application knows the beats to be this worker's.
    Pulse(zmq::context_t& context, const std::string& endpoint, const std::optional<WorkerKeys>& keys,
          const Secret& secret);

    /// From now on sends heartbeats of this member. If this process has not ended 0.4 s after the application's
    /// end, it is ended.
    void joined(std::uint32_t worker) noexcept { worker_ = worker; }
    [[nodiscard]] bool application_gone() const noexcept { return gone_; }  ///< set once

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
    std::jthread thread_;  // last: starts when the rest is there, joins before it goes
};

}  // namespace sim
