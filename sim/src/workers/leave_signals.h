#pragma once

namespace sim {

/// From here on SIGTERM, SIGINT and SIGHUP ask once to leave; a second one ends the process. A SIGHUP that is ignored (nohup)
/// stays so.
void listen_for_leave();
[[nodiscard]] bool leave_asked();
/// They end the process again; at once, if one has come.
void stop_listening_for_leave();

}  // namespace sim
