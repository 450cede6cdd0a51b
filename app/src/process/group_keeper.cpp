#include "process/group_keeper.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <string>

#include "process/child_process.h"

namespace app {

GroupKeeper::GroupKeeper(int group) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        throw std::runtime_error(
            fmt::format("found that making a pipe failed ({}), expected it to work", std::strerror(errno)));
    pipe_ = ends[1];
    // In a group of its own it outlives what the terminal sends to this program's.
    const std::string script = fmt::format("read end; kill -9 -{}", group);
    try {
        keeper_ = start_child({{"sh", "-c", script}, {}, ends[0], STDERR_FILENO, -1, true});
    } catch (...) {
        close(ends[0]);
        close(ends[1]);
        throw;
    }
    close(ends[0]);
}

GroupKeeper::~GroupKeeper() {
    close(pipe_);
    (void)wait_for_child(keeper_);
}

}  // namespace app
