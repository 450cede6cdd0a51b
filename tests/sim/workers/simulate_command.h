#pragma once
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace sim_test {

/// A TCP endpoint on loopback that nobody listens on just now.
inline std::string free_endpoint() {
    const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    (void)bind(probe, reinterpret_cast<sockaddr*>(&address), size);
    (void)getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size);
    close(probe);
    return "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

/// `musicworld simulate ARGUMENTS` as a process of its own, its words and errors in one text.
class SimulateCommand {
public:
    struct Ended {
        int status = -1;
        std::string text;
    };
    /// Without a search for leaks at its end: a child of it does that, and Fate kills its children.
    explicit SimulateCommand(const std::string& arguments)
        : pipe_(popen(("export ASAN_OPTIONS=detect_leaks=0; exec " MUSICWORLD_PROGRAM " simulate " +
                       arguments + " 2>&1")
                          .c_str(),
                      "re")) {
        if (pipe_ == nullptr) throw std::runtime_error("cannot start simulate");
    }
    ~SimulateCommand() {
        if (pipe_ != nullptr) pclose(pipe_);
    }
    SimulateCommand(const SimulateCommand&) = delete;
    SimulateCommand& operator=(const SimulateCommand&) = delete;

    /// Reads until it has said where it listens; workers may join then.
    void wait_until_listening() {
        for (int c = 0; text_.find("listening: ") == text_.npos || text_.back() != '\n';) {
            if ((c = std::fgetc(pipe_)) == EOF) return;
            text_ += static_cast<char>(c);
        }
    }
    Ended wait() {
        Ended ended;
        ended.text = text_;
        std::array<char, 4096> part{};
        while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe_))
            ended.text.append(part.data(), size);
        const int status = pclose(std::exchange(pipe_, nullptr));
        ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        return ended;
    }

private:
    FILE* pipe_;
    std::string text_;  // read so far
};

}  // namespace sim_test
