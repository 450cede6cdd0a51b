#include "process/line_child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <stdexcept>

#include "files/bad_input.h"
#include "process/child_process.h"
#include "process/clock.h"

namespace app {
namespace {

[[noreturn]] void fail_system(const char* action) {
    throw std::runtime_error(cannot(action));
}

/// A file without a name, which no other child inherits.
std::FILE* memory_file() {
    const int descriptor = memfd_create("errors", MFD_CLOEXEC);
    if (descriptor < 0) fail_system("make a temporary file");
    std::FILE* file = fdopen(descriptor, "w+");
    if (!file) fail_system("open a temporary file");
    return file;
}

}  // namespace

LineChild::LineChild(const std::string& command) : errors_(memory_file()) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail_system("make a socket");
    socket_ = FileDescriptor(ends[0]);
    const FileDescriptor of_child(ends[1]);
    Pipe life = make_pipe();
    pid_ = start_child({{"sh", "-c", command},
                        {},
                        of_child.get(),
                        of_child.get(),
                        fileno(errors_.get()),
                        true,
                        {life.out.get()}});
    life_ = std::move(life.in);
    // Lets the system kill the process group when the other end of this pipe closes.
    const int end = life.out.get();
    if (fcntl(end, F_SETOWN, -pid_) == 0 && fcntl(end, F_SETSIG, SIGKILL) == 0 &&
        fcntl(end, F_SETFL, O_ASYNC) == 0)
        return;
    const std::string why = cannot("tie the child's end to this program's");
    (void)collect();
    throw std::runtime_error(why);
}

LineChild::~LineChild() {
    shutdown(socket_.get(), SHUT_WR);
    const std::int64_t deadline_ns = monotonic_ns() + to_ns(kFarewellS);
    while (pid_ > 0 && readable_until(socket_.get(), deadline_ns) &&
           recv(socket_.get(), chunk_.data(), chunk_.size(), 0) > 0) {
    }
    if (pid_ > 0) collect();
}

std::optional<int> LineChild::collect() {
    // A moment to end by itself, so that its status is its own.
    constexpr int kTries = 20;
    constexpr useconds_t kPauseUs = 5000;
    siginfo_t ended{};
    bool by_itself = false;
    for (int i = 0; i < kTries; ++i) {
        (void)waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT);
        by_itself = ended.si_pid == pid_;
        if (by_itself) break;
        usleep(kPauseUs);
    }
    kill(-pid_, SIGKILL);  // the group outlives its leader until that is collected
    const int status = wait_for_child(pid_);
    pid_ = -1;
    return by_itself ? std::optional(status) : std::nullopt;
}

std::string LineChild::last_words() const {
    constexpr long kTail = 4096;
    std::FILE* file = errors_.get();
    if (std::fseek(file, 0, SEEK_END) != 0) return {};
    (void)std::fseek(file, -std::min(std::ftell(file), kTail), SEEK_END);
    std::string text(kTail, '\0');
    text.resize(std::fread(text.data(), 1, text.size(), file));
    text.erase(std::min(text.find_last_not_of(" \t\r\n") + 1, text.size()));
    return one_line(text.substr(text.rfind('\n') + 1));
}

void LineChild::fail_ended() {
    const std::optional<int> status = collect();
    const std::string words = last_words();
    throw std::runtime_error(
        fmt::format("found the child {}{}, expected it to answer",
                    status ? fmt::format("ended with status {}", *status) : std::string("closed its output"),
                    words.empty() ? "" : fmt::format(" saying \"{}\"", words)));
}

void LineChild::wait_for(short event, std::int64_t deadline_ns, double timeout_s) {
    pollfd socket{socket_.get(), event, 0};
    for (;;) {
        const int ready = poll(&socket, 1, milliseconds_until(deadline_ns));
        if (ready > 0) return;
        if (ready < 0 && errno != EINTR) fail_system("wait for the child");
        if (ready == 0)
            throw std::runtime_error(
                fmt::format("found {} within {} s, expected one line for each line sent; does it flush its "
                            "output?",
                            event == POLLIN ? "no whole line" : "that the child does not read", timeout_s));
    }
}

void LineChild::send(std::string_view text, double timeout_s) {
    if (pid_ <= 0) throw std::runtime_error("found that the child has ended, expected it to answer");
    const std::int64_t deadline_ns = monotonic_ns() + to_ns(timeout_s);
    while (!text.empty()) {
        const ssize_t sent = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent >= 0)
            text.remove_prefix(static_cast<std::size_t>(sent));
        else if (errno == EAGAIN)
            wait_for(POLLOUT, deadline_ns, timeout_s);
        else if (errno != EINTR)
            return;  // it has ended: receive() says how, and what it had sent before
    }
}

std::string_view LineChild::receive(double timeout_s) {
    const std::int64_t deadline_ns = monotonic_ns() + to_ns(timeout_s);
    received_.erase(0, taken_);
    taken_ = 0;
    std::size_t end = received_.find('\n');
    while (end == std::string::npos) {
        if (received_.size() > kLongestLine)
            throw std::runtime_error(
                fmt::format("found a line of more than {} bytes, expected a short one", kLongestLine));
        wait_for(POLLIN, deadline_ns, timeout_s);
        const std::size_t before = received_.size();
        const ssize_t got = recv(socket_.get(), chunk_.data(), chunk_.size(), 0);
        if (got == 0 || (got < 0 && errno != EINTR)) fail_ended();
        received_.append(chunk_.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
        end = received_.find('\n', before);
    }
    taken_ = end + 1;
    if (taken_ < received_.size()) {
        const std::string second = received_.substr(taken_, received_.find('\n', taken_) - taken_);
        throw std::runtime_error(fmt::format(
            "found a second line, \"{}\", expected one line for each line sent", one_line(second, 60)));
    }
    return std::string_view(received_).substr(0, end);
}

}  // namespace app
