#include "files/file_descriptor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace app {

bool FileDescriptor::write(std::string_view bytes) const noexcept {
    while (!bytes.empty()) {
        const ssize_t wrote = ::write(number_, bytes.data(), bytes.size());
        if (wrote > 0) bytes.remove_prefix(static_cast<std::size_t>(wrote));
        if (wrote == 0) errno = ENOSPC;
        if (wrote < 0 && errno == EAGAIN) {  // one that was opened elsewhere, not to wait
            pollfd room{number_, POLLOUT, 0};
            (void)::poll(&room, 1, -1);
        } else if (wrote == 0 || (wrote < 0 && errno != EINTR)) {
            return false;
        }
    }
    return true;
}

bool FileDescriptor::close() noexcept {
    const int number = std::exchange(number_, -1);
    return number < 0 || ::close(number) == 0 || errno == EINTR;  // closed by then, too
}

FileDescriptor open_file(const std::filesystem::path& file, int flags, unsigned mode) noexcept {
    int number = -1;
    do number = ::open(file.c_str(), flags | O_CLOEXEC, mode);
    while (number < 0 && errno == EINTR);
    return FileDescriptor(number);
}

bool save(const FileDescriptor& file) noexcept {
    int result = 0;
    do result = ::fsync(file.get());
    while (result != 0 && errno == EINTR);
    return result == 0 || errno == EINVAL || errno == EROFS || errno == EOPNOTSUPP;
}

Pipe make_pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("error: " + cannot("make a pipe"));
    return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

std::string cannot(std::string_view action, int error) {
    return fmt::format("cannot {}: {}", action, std::strerror(error != 0 ? error : errno));
}

}  // namespace app
