#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <mutex>
#include <thread>
#include <zmq.hpp>

#include "messages.h"
#include "socket_folder.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kHeartbeatEvery = 100ms;
constexpr auto kWelcomeWithin = 10s;

zmq::socket_t connect(zmq::context_t& context, const std::string& endpoint, int linger_ms) {
    zmq::socket_t socket(context, zmq::socket_type::dealer);
    socket.set(zmq::sockopt::linger, linger_ms);
    socket.set(zmq::sockopt::sndhwm, 1000);
    socket.set(zmq::sockopt::rcvhwm, 1000);
    socket.set(zmq::sockopt::sndtimeo, 1000);
    socket.set(zmq::sockopt::reconnect_ivl, 50);
    socket.connect(endpoint);
    return socket;
}

bool send(zmq::socket_t& socket, const Message& message, zmq::send_flags flags = zmq::send_flags::none) {
    const std::vector<std::uint8_t> bytes = encode(message);
    return socket.send(zmq::buffer(bytes), flags).has_value();
}

/// Sends heartbeats from a thread of its own, so that long work is not taken for death, and watches for the
/// application's end: our parent is then no longer the application.
class Pulse {
public:
    Pulse(zmq::context_t& context, const std::string& endpoint)
        : parent_(application_of(endpoint) != 0 ? static_cast<pid_t>(application_of(endpoint)) : getppid()),
          thread_(
              [this, &context, endpoint](const std::stop_token& stop) { beat(context, endpoint, stop); }) {}

    [[nodiscard]] bool application_gone() const noexcept { return gone_; }

private:
    void beat(zmq::context_t& context, const std::string& endpoint, const std::stop_token& stop) {
        zmq::socket_t socket = connect(context, endpoint, 0);
        const Heartbeat heartbeat{static_cast<std::uint32_t>(getpid())};
        std::mutex mutex;
        std::unique_lock lock(mutex);
        std::condition_variable_any wake;
        while (!stop.stop_requested()) {
            send(socket, heartbeat, zmq::send_flags::dontwait);
            if (getppid() != parent_) gone_ = true;
            wake.wait_for(lock, stop, kHeartbeatEvery, [] { return false; });
        }
    }

    const pid_t parent_;  ///< the application; whoever started us if the endpoint does not tell
    std::atomic<bool> gone_ = false;
    std::jthread thread_;  // last: starts when the rest is there, joins before it goes
};

class Worker {
public:
    explicit Worker(const std::string& endpoint)
        : socket_(connect(context_, endpoint, 200)), pulse_(context_, endpoint) {
        socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(kHeartbeatEvery.count()));
    }

    /// 0 when told to stop, 1 when the application is gone.
    int serve() {
        send(socket_, Hello{static_cast<std::uint32_t>(getpid())});
        const auto started = std::chrono::steady_clock::now();
        zmq::message_t frame;
        while (!pulse_.application_gone()) {
            if (!welcomed_ && std::chrono::steady_clock::now() - started > kWelcomeWithin) return 1;
            if (!receive(frame)) continue;
            const Message message = decode({frame.data<std::uint8_t>(), frame.size()});
            if (std::holds_alternative<Stop>(message)) return 0;
            std::visit([this](const auto& m) { handle(m); }, message);
        }
        return 1;
    }
    void report(const std::string& failure) { send(socket_, Failure{failure}); }

private:
    bool receive(zmq::message_t& frame) {
        try {
            return socket_.recv(frame).has_value();
        } catch (const zmq::error_t& e) {
            if (e.num() == EINTR) return false;
            throw;
        }
    }
    void handle(const Welcome&) { welcomed_ = true; }
    void handle(const Assign& assign) {
        for (const Assignment& a : assign.bodies)
            bodies_.insert_or_assign(a.body, SteppedBody(a.body, a.definition, a.record));
    }
    void handle(const Step& step) {
        Answer answer{step.epoch, step.step, std::vector<BodyOutcome>(step.bodies.size())};
        for (std::size_t i = 0; i < step.bodies.size(); ++i) {
            const auto found = bodies_.find(step.bodies[i]);
            if (found == bodies_.end())
                throw DecodeError("a step of body " + std::to_string(step.bodies[i]) + ", not assigned");
            found->second.step(step.request, answer.outcomes[i]);
        }
        send(socket_, answer);
    }
    template <typename Other>
    void handle(const Other&) {
        throw DecodeError("a message that only workers send");
    }

    zmq::context_t context_;
    zmq::socket_t socket_;
    Pulse pulse_;
    std::map<std::uint32_t, SteppedBody> bodies_;
    bool welcomed_ = false;
};

}  // namespace

int run_worker(const std::string& endpoint) {
    try {
        Worker worker(endpoint);
        try {
            const int status = worker.serve();
            if (status != 0) remove_left_socket(endpoint);
            return status;
        } catch (const DecodeError& e) {
            worker.report(e.what());
            std::fprintf(stderr, "worker: bad message: %s\n", e.what());
        }
    } catch (const std::exception& e) {
        std::fprintf(stderr, "worker: %s\n", e.what());
    }
    return 1;
}

}  // namespace sim
