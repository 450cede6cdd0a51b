#include "workers/world_service.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <utility>

#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/elapsed.h"
#include "world/processor_time.h"

namespace sim {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPollMs = 50;
constexpr double kLongestWithin = 2;  // that a step waits for others [s]; then it is done alone

volatile std::sig_atomic_t drain_asked = 0;

/// SIGTERM and SIGINT ask once for a drain; a second one ends the process.
void listen_for_drain() {
    struct sigaction action {};
    action.sa_handler = [](int) { drain_asked = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGTERM, &action, nullptr);
    sigaction(SIGINT, &action, nullptr);
}

/// A ZeroMQ call, again if a signal interrupts it.
template <typename Call>
auto through_signals(const Call& call) {
    for (;;) {
        try {
            return call();
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }
}

/// Sleeps through a signal too.
void sleep_for(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

class WorldService {
public:
    WorldService(zmq::socket_t& socket, Pulse& pulse, const SceneMessage& scene)
        : socket_(socket), pulse_(pulse), worker_(scene), header_{scene.worker, 0, 0} {}

    int serve() {
        try {
            return serve_steps();
        } catch (const Gone&) {
            return 1;
        }
    }
    void report(const std::string& what) { send(encode(header_, WorkerFailure{what})); }

private:
    struct Gone {};  ///< the application, within a step

    int serve_steps() {
        while (!worker_.ended() && !pulse_.application_gone()) {
            take_all();
            if (drain_asked && !std::exchange(draining_, true)) worker_.drain();
            if (!worker_.ended() && worker_.ready()) step();
            send_all();
            if (worker_.left()) return 0;
            if (!worker_.ready()) wait();
        }
        if (pulse_.application_gone()) return 1;
        return refused_ ? 1 : 0;
    }
    void take_all() {
        zmq::message_t frame;
        while (through_signals([&] { return socket_.recv(frame, zmq::recv_flags::dontwait); })) {
            const auto* bytes = frame.data<std::uint8_t>();
            DecodedWorldMessage m = decode_for_worker({bytes, frame.size()});
            if (const auto* refusal = std::get_if<Refusal>(&m.message)) {
                std::fprintf(stderr, "worker: refused: %s\n", refusal->why.c_str());
                refused_ = true;
            }
            worker_.take(m.header, std::move(m.message));
        }
    }
    void step() {
        const double waited = seconds_since(idle_since_), factor = worker_.slowing();
        const Clock::time_point start = Clock::now();
        waited_within_ = 0;
        worker_.step([this](bool wait) { flush(wait); });
        const double worked = seconds_since(start) - waited_within_;
        if (factor > 1) sleep_for((factor - 1) * worked);
        const double processor = thread_processor_s();
        worker_.worked({std::max(factor, 1.0) * worked, waited + waited_within_,
                        processor - std::exchange(told_processor_, processor)});
        idle_since_ = Clock::now();
    }
    /// Within a step: until something came, or what others do not tell has been waited for long enough.
    void flush(bool must_wait) {
        send_all();
        if (!must_wait) return;
        const Clock::time_point start = Clock::now();
        wait();
        waited_within_ += seconds_since(start);
        if (pulse_.application_gone()) throw Gone{};
        take_all();
        if (waited_within_ > kLongestWithin) worker_.stop_waiting();
    }
    void send_all() {
        for (const std::vector<std::uint8_t>& bytes : worker_.outgoing()) send(bytes);
    }
    /// The application may be busy, with pictures, and take what it can.
    void send(const std::vector<std::uint8_t>& bytes) {
        while (!through_signals([&] { return socket_.send(zmq::buffer(bytes), zmq::send_flags::none); }))
            if (pulse_.application_gone()) return;
    }
    /// Until something comes, or a signal, or a look at the application is due.
    void wait() {
        zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
        try {
            zmq::poll(&item, 1, std::chrono::milliseconds(kPollMs));
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }

    zmq::socket_t& socket_;
    Pulse& pulse_;
    SharedWorldWorker worker_;
    WorldHeader header_;
    bool draining_ = false, refused_ = false;
    double waited_within_ = 0;  ///< the step under way
    Clock::time_point idle_since_ = Clock::now();
    double told_processor_ = thread_processor_s();
};

int serve_scene(zmq::socket_t& socket, Pulse& pulse, const SceneMessage& scene) {
    pulse.join_world(scene.worker);
    listen_for_drain();
    WorldService service(socket, pulse, scene);
    try {
        return service.serve();
    } catch (const std::exception& e) {
        service.report(e.what());
        throw;
    }
}

}  // namespace

int serve_world(zmq::socket_t& socket, Pulse& pulse, zmq::message_t& first) {
    const DecodedWorldMessage m = decode_world({first.data<std::uint8_t>(), first.size()});
    if (const auto* refusal = std::get_if<Refusal>(&m.message)) {
        std::fprintf(stderr, "worker: refused: %s\n", refusal->why.c_str());
        return 1;
    }
    if (const auto* scene = std::get_if<SceneMessage>(&m.message)) return serve_scene(socket, pulse, *scene);
    return std::holds_alternative<EndOfRun>(m.message) ? 0 : 1;
}

std::vector<std::uint8_t> join_request(const Secret& secret) {
    std::array<char, 256> host{};
    gethostname(host.data(), host.size() - 1);
    return encode(WorldHeader{}, JoinRequest{step_fingerprint(), secret, host.data()});
}

}  // namespace sim
