#pragma once
#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "files/file_descriptor.h"

namespace app {

/// A program run by `sh -c COMMAND` with which lines are exchanged: its standard input and output are one
/// socket, its standard error is kept for messages. It runs in a process group of its own; the destructor
/// ends its input, gives it kFarewellS to leave, and kills and collects what is left of it.
///
/// However this program ends, the system then kills the group (SIGKILL): the child inherits the end of a pipe
/// whose other end only this program has, and the system signals to the group when that closes (fcntl:
/// O_ASYNC, F_SETOWN, F_SETSIG). That needs no process or thread that lives on. What it does not reach: a
/// process that leaves the group, and a group in which no process keeps the inherited descriptor open.
///
/// All faults are thrown as std::runtime_error "found ..., expected ...; ...", one line.
class LineChild {
public:
    static constexpr double kFarewellS = 1;
    static constexpr std::size_t kLongestLine = std::size_t{1} << 20;

    explicit LineChild(const std::string& command);
    ~LineChild();
    LineChild(const LineChild&) = delete;
    LineChild& operator=(const LineChild&) = delete;

    /// Sends a line (text with its line end), waiting at most `timeout_s` for the child to make room.
    void send(std::string_view text, double timeout_s);
    /// The next line, without its end, valid until the next call. Waits at most `timeout_s`; a second line
    /// that follows it at once is a fault.
    [[nodiscard]] std::string_view receive(double timeout_s);

private:
    struct CloseFile {
        void operator()(std::FILE* file) const { (void)std::fclose(file); }
    };
    /// Waits until the socket can be read (or written); throws if that takes longer than until `deadline_ns`.
    void wait_for(short event, std::int64_t deadline_ns, double timeout_s);
    [[noreturn]] void fail_ended();
    /// Kills what is left of the child and collects it; returns how it ended by itself (as wait_for_child()).
    std::optional<int> collect();
    [[nodiscard]] std::string last_words() const;

    std::unique_ptr<std::FILE, CloseFile> errors_;
    FileDescriptor life_;  // the group is killed when this closes
    FileDescriptor socket_;
    int pid_ = -1;
    std::array<char, std::size_t{1} << 16> chunk_{};
    std::string received_;
    std::size_t taken_ = 0;  // bytes of it that were handed out
};

}  // namespace app
