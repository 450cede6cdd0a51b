#include "tracking/input.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <system_error>

#include "trace/text_cursor.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 30, kChunk = std::size_t{1} << 20;
constexpr std::chrono::seconds kPatience{10};  // until somebody writes into a named pipe
constexpr int kLookAgainMs = 20;

/// An open file with what it is called in messages.
class InputFile {
public:
    InputFile(const std::string& name, const std::string& expected) : name_(name), expected_(expected) {
        // Otherwise opening a pipe would wait for its writer.
        do number_ = open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
        while (number_ < 0 && errno == EINTR);
        if (number_ < 0) fail(std::generic_category().message(errno), "check the path and its permissions");
    }
    ~InputFile() { close(number_); }
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    std::string read() {
        struct stat status {};
        if (fstat(number_, &status) != 0) fail(std::generic_category().message(errno), "check the disk");
        if (S_ISDIR(status.st_mode)) fail("a directory", "name the file in it");
        if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) fail("a device", "copy it to a file");
        bool awaits_writer = S_ISFIFO(status.st_mode) && has_name();
        const auto deadline = std::chrono::steady_clock::now() + kPatience;
        std::string text;
        for (;;) {
            const std::size_t before = text.size();
            text.resize(before + kChunk);
            const ssize_t got = ::read(number_, text.data() + before, kChunk);
            const int error = errno;
            text.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
            if (text.size() > kLargestFile) fail("more than 1 GiB", "split it");
            if (got == 0 && !awaits_writer) return text;
            if (got == 0 && std::chrono::steady_clock::now() > deadline)
                fail("a pipe that nobody writes into", "start its writer");
            if (got < 0 && error != EAGAIN && error != EINTR)
                fail("a read error (" + std::generic_category().message(error) + ")", "check the disk");
            if (got != 0) awaits_writer = false;  // EAGAIN: there is a writer, who is busy
            if (awaits_writer || (got < 0 && error == EAGAIN)) wait(awaits_writer ? kLookAgainMs : -1);
        }
    }

private:
    [[noreturn]] void fail(const std::string& found, const std::string& remedy) const {
        Line(name_, 1, "").fail(0, found, expected_, remedy);
    }
    void wait(int milliseconds) const {
        pollfd ready{number_, POLLIN, 0};
        (void)poll(&ready, 1, milliseconds);
    }
    /// A shell's pipe has none: both of its ends were open from the start.
    [[nodiscard]] bool has_name() const {
        std::error_code ignored;
        const std::filesystem::path what =
            std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(number_), ignored);
        return what.is_absolute();
    }

    const std::string &name_, &expected_;
    int number_ = -1;
};

}  // namespace

TraceError::TraceError(std::string_view text) : std::runtime_error(printable(text)) {}

std::string printable(std::string_view text) {
    std::string out;
    for (std::size_t bad = first_unprintable(text); bad != std::string_view::npos;
         bad = first_unprintable(text)) {
        out.append(text.substr(0, bad)) += '?';
        text.remove_prefix(bad + 1);
    }
    out += text;
    std::replace(out.begin(), out.end(), '\t', ' ');
    return out;
}

std::string read_bytes(const std::string& file, const std::string& expected) {
    return InputFile(file, expected).read();
}

}  // namespace tracking
