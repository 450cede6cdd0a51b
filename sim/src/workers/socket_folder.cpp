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

/// The folder of `endpoint`, if SocketFolder made it; else empty.
std::string folder_of(const std::string& endpoint) {
    const std::string scheme = "ipc://";
    if (!endpoint.starts_with(scheme) || !endpoint.ends_with(kSocket)) return {};
    const std::string folder =
        endpoint.substr(scheme.size(), endpoint.size() - scheme.size() - std::strlen(kSocket));
    return folder.rfind('/') == folder.rfind(kPrefix) ? folder : std::string();
}

/// Removes the socket and the folder, and nothing else.
void remove_folder(const std::string& folder) noexcept {
    unlink((folder + kSocket).c_str());
    rmdir(folder.c_str());
}

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
    remove_folder(path_);
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
    const std::string folder = folder_of(endpoint);
    if (!folder.empty()) remove_folder(folder);
}

}  // namespace sim
