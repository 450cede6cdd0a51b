#include "workers/heartbeat.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>

#include "messages/worker_messages.h"
#include "workers/signals.h"
#include "workers/socket_folder.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
constexpr auto kBeatEvery = 100ms;
constexpr auto kBeatSilence = 1500ms;
// After a longer gap between two beats this process was paused, and the application was not silent.
constexpr auto kBeatPaused = 300ms;
constexpr auto kBeatEndWithin = 400ms;
constexpr std::int64_t kBeatLargestMessage = 256 << 20;

/// Receives all messages that have come; returns whether there were any.
bool receive_all(zmq::socket_t& socket) {
    zmq::message_t frame;
    bool any = false;
    while (socket.recv(frame, zmq::recv_flags::dontwait)) any = true;
    return any;
}

}  // namespace

zmq::socket_t connect_worker(zmq::context_t& context, const std::string& endpoint,
                             const std::optional<WorkerKeys>& keys, int linger_ms) {
    zmq::socket_t socket(context, zmq::socket_type::dealer);
    socket.set(zmq::sockopt::linger, linger_ms);
    socket.set(zmq::sockopt::sndhwm, 100000);
    socket.set(zmq::sockopt::rcvhwm, 100000);
    socket.set(zmq::sockopt::sndtimeo, 1000);
    socket.set(zmq::sockopt::reconnect_ivl, 50);
    socket.set(zmq::sockopt::maxmsgsize, kBeatLargestMessage);
    socket.set(zmq::sockopt::ipv6, true);
    if (keys) {
        socket.set(zmq::sockopt::curve_serverkey, keys->application);
        socket.set(zmq::sockopt::curve_publickey, keys->pair.shown);
        socket.set(zmq::sockopt::curve_secretkey, keys->pair.secret);
    }
    socket.connect(endpoint);
    return socket;
}

Heartbeat::Heartbeat(zmq::context_t& context, const std::string& endpoint,
                     const std::optional<WorkerKeys>& keys, const Secret& secret)
    : endpoint_(endpoint),
      secret_(secret),
      application_(static_cast<pid_t>(application_of(endpoint))),
      child_(application_ == getppid()),
      thread_([this, &context, keys](const std::stop_token& stop) { beat(context, keys, stop); }) {}

bool Heartbeat::application_process_ended() const noexcept {
    if (application_ == 0) return false;
    return child_ ? getppid() != application_ : kill(application_, 0) != 0 && errno == ESRCH;
}

void Heartbeat::send_beat(zmq::socket_t& socket) const {
    const std::int64_t worker = worker_;
    const std::vector<std::uint8_t> bytes =
        encode(MessageHeader{worker == kNoMember ? kApplication : static_cast<std::uint32_t>(worker), 0, 0},
               Beat{secret_});
    (void)socket.send(zmq::buffer(bytes), zmq::send_flags::dontwait);
}

void Heartbeat::beat(zmq::context_t& context, const std::optional<WorkerKeys>& keys,
                     const std::stop_token& stop) {
    block_signals();
    zmq::socket_t socket = connect_worker(context, endpoint_, keys, 0);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any wake;
    Clock::time_point received = Clock::now(), checked = received, ended{};
    while (!stop.stop_requested()) {
        send_beat(socket);
        const Clock::time_point now = Clock::now();
        if (receive_all(socket) || worker_ == kNoMember || now - checked > kBeatPaused) received = now;
        checked = now;
        if (!gone_ && (application_process_ended() || (application_ == 0 && now - received > kBeatSilence)))
            ended = now, gone_ = true;
        if (gone_ && worker_ != kNoMember && now - ended > kBeatEndWithin) {
            std::fputs("worker: the application is gone, or has given this worker up\n", stderr);
            remove_left_socket(endpoint_);
            _exit(1);
        }
        wake.wait_for(lock, stop, kBeatEvery, [] { return false; });
    }
}

}  // namespace sim
