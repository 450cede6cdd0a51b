#include "workers/socket_folder.h"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>

#include "sim/errors.h"

namespace sim {
namespace {

constexpr const char* kPrefix = "/musicworld-";
constexpr const char* kSocket = "/workers";
constexpr std::size_t kLongestPath = 99;  // a Unix socket's path has 107 characters at most

}  // namespace

SocketFolder::SocketFolder() {
    const char* wanted = std::getenv("TMPDIR");
    const std::string name = kPrefix + std::to_string(getpid()) + "-XXXXXX";
    std::string pattern = (wanted && *wanted ? wanted : "/tmp") + name;
    if (pattern.size() + std::strlen(kSocket) > kLongestPath) pattern = "/tmp" + name;
    if (!mkdtemp(pattern.data())) {
        throw WorkerError("cannot make a folder " + pattern +
                          " for the workers' socket: " + std::strerror(errno));
    }
    path_ = pattern;
}

SocketFolder::~SocketFolder() {
    unlink((path_ + kSocket).c_str());
    rmdir(path_.c_str());
}

std::uint32_t application_of(const std::string& endpoint) noexcept {
    const std::size_t at = endpoint.rfind(kPrefix);
    std::uint32_t process = 0;
    if (at != std::string::npos) {
        const char* digits = endpoint.data() + at + std::strlen(kPrefix);
        std::from_chars(digits, endpoint.data() + endpoint.size(), process);
    }
    return process;
}

void remove_left_socket(const std::string& endpoint) noexcept {
    if (!endpoint.starts_with("ipc://") || !endpoint.ends_with(kSocket)) return;
    const std::string socket = endpoint.substr(std::strlen("ipc://"));
    const std::string folder = socket.substr(0, socket.size() - std::strlen(kSocket));
    if (folder.rfind('/') != folder.rfind(kPrefix)) return;
    unlink(socket.c_str());
    rmdir(folder.c_str());
}

}  // namespace sim
