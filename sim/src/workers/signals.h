#pragma once

namespace sim {

/// From here on SIGTERM, SIGINT and SIGHUP ask this process once to leave; a second signal ends it. A SIGHUP
/// that is ignored (nohup) stays ignored.
void listen_for_leave();
[[nodiscard]] bool leave_asked();
/// From here on these signals end the process again. If one has come, it does so now.
void stop_listening_for_leave();

/// Blocks all signals in the calling thread: a signal would make a ZeroMQ call fail. Main threads handle
/// them.
void block_signals() noexcept;

}  // namespace sim
