#pragma once
#include <cstdint>
#include <string>

namespace sim {

/// A private folder (0700, musicworld-PROCESS-XXXXXX under TMPDIR or /tmp) for the workers' ipc socket. The
/// destructor removes both.
class SocketFolder {
public:
    SocketFolder();  ///< throws std::runtime_error
    ~SocketFolder();
    SocketFolder(const SocketFolder&) = delete;
    SocketFolder& operator=(const SocketFolder&) = delete;

    [[nodiscard]] std::string endpoint() const { return "ipc://" + path_ + "/workers"; }

private:
    std::string path_;
};

/// Process id of the application that made `endpoint`, from its folder's name; 0 if SocketFolder did not make
/// it.
[[nodiscard]] std::uint32_t application_of(const std::string& endpoint) noexcept;

/// Removes the socket and its folder that an application left at `endpoint` when it ended abnormally, if
/// SocketFolder made them.
void remove_left_socket(const std::string& endpoint) noexcept;

}  // namespace sim
