#include "import_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string>
#include <system_error>

namespace render {
namespace {

/// Of an installation PREFIX/bin/musicworld: PREFIX/libexec/musicworld/musicworld_mesh_import; else the build's.
std::string importer() {
    std::error_code ignored;
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const std::filesystem::path installed =
        program.parent_path().parent_path() / "libexec" / "musicworld" / "musicworld_mesh_import";
    return std::filesystem::exists(installed, ignored) ? installed.string() : MUSICWORLD_MESH_IMPORT;
}

[[noreturn]] void fail(int error, const std::string& what) {
    throw std::system_error(error, std::generic_category(), what);
}

constexpr std::chrono::seconds kLongestWait{20};
constexpr std::size_t kMostBytes = 64u << 20;  // 500000 triangles with vertices of their own: 42 MB

/// Standard input and error of the child are closed to it: /dev/null.
class SpawnActions {
public:
    explicit SpawnActions(int output) {
        posix_spawn_file_actions_init(&actions_);
        posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
        posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    }
    ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
    SpawnActions(const SpawnActions&) = delete;
    SpawnActions& operator=(const SpawnActions&) = delete;
    const posix_spawn_file_actions_t* get() const { return &actions_; }

private:
    posix_spawn_file_actions_t actions_;
};

}  // namespace

ImportProcess::ImportProcess(const std::filesystem::path& file) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        fail(errno, "error: cannot make a pipe to the importer of meshes");
    }
    pipe_ = ends[0];
    const SpawnActions actions(ends[1]);
    std::string program = importer(), argument = file.string();
    char* arguments[] = {program.data(), argument.data(), nullptr};
    const int error = posix_spawn(&child_, program.c_str(), actions.get(), nullptr, arguments, environ);
    close(ends[1]);
    if (error != 0) {
        child_ = -1;
        close(pipe_);
        fail(error, "error: cannot start " + program);
    }
}

ImportProcess::~ImportProcess() {
    if (child_ > 0) {
        kill(child_, SIGKILL);
        (void)wait_for_exit();
    }
    close(pipe_);
}

std::string ImportProcess::output() {
    std::string bytes;
    read_until_closed(bytes);
    const int status = wait_for_exit();
    if (WIFSIGNALED(status)) {
        throw std::runtime_error("found a file on which the importer ended with signal " +
                                 std::to_string(WTERMSIG(status)) + ", expected a sound mesh file");
    }
    if (status != 0)
        throw std::runtime_error(
            "found a file that the importer cannot hold in its limits, expected a sound mesh file");
    return bytes;
}

void ImportProcess::read_until_closed(std::string& bytes) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point deadline = Clock::now() + kLongestWait;
    std::array<char, 65536> block;
    for (;;) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
        pollfd ready{pipe_, POLLIN, 0};
        const int events = left.count() > 0 ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
        if (events == 0)
            throw std::runtime_error(
                "found a file that takes over 20 s to import, expected a sound mesh file");
        const ssize_t count = events > 0 ? read(pipe_, block.data(), block.size()) : -1;
        if (count == 0) return;
        if (count < 0) {
            if (errno == EINTR || errno == EAGAIN) continue;
            fail(errno, "error: cannot read from the importer of meshes");
        }
        bytes.append(block.data(), static_cast<std::size_t>(count));
        if (bytes.size() > kMostBytes)
            throw std::runtime_error("found over 64 MB of mesh, expected 1 to 500000 triangles");
    }
}

int ImportProcess::wait_for_exit() {
    int status = 0;
    pid_t ended = -1;
    do {
        ended = waitpid(child_, &status, 0);
    } while (ended < 0 && errno == EINTR);
    child_ = -1;
    return status;
}

}  // namespace render
