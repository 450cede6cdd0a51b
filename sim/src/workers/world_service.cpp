#include "workers/world_service.h"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>

#include "run/elapsed_time.h"
#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/signals.h"

namespace sim {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPollMs = 50;
constexpr double kLongestForAnswer = 0.5;  // the next step waits so long for the answer to an offer [s]

/// Repeats a ZeroMQ call that a signal interrupts.
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

/// Signals do not end the sleep.
void sleep_for(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

class WorldService {
public:
    WorldService(zmq::socket_t& socket, Heartbeat& heartbeat, int threads, const SceneMessage& scene)
        : socket_(socket), heartbeat_(heartbeat), threads_(threads), worker_(scene), number_(scene.worker) {
        worker_.use_threads(threads_);
    }

    int serve() {
        while (!worker_.ended() && !heartbeat_.application_gone()) {
            receive_all();
            if (leave_asked() && !std::exchange(draining_, true)) worker_.drain();
            check_offer();
            if (!worker_.ended() && worker_.ready()) step();
            send_all();
            if (worker_.left()) return 0;
            if (!worker_.ready()) wait();
        }
        return heartbeat_.application_gone() || refused_ ? 1 : 0;
    }
    void report_failure(const std::string& what) { send(encode({number_, 0, 0}, WorkerFailure{what})); }

private:
    /// A worker that does not answer an offer does not hold up this one.
    void check_offer() {
        if (!worker_.awaits_answer())
            offered_since_.reset();
        else if (!offered_since_)
            offered_since_ = Clock::now();
        else if (seconds_since(*offered_since_) > kLongestForAnswer)
            worker_.stop_waiting_for_answer();
    }
    void receive_all() {
        zmq::message_t frame;
        while (through_signals([&] { return socket_.recv(frame, zmq::recv_flags::dontwait); })) {
            const auto* bytes = frame.data<std::uint8_t>();
            DecodedMessage m = decode_message({bytes, frame.size()});
            if (const auto* refusal = std::get_if<Refusal>(&m.message)) {
                std::fprintf(stderr, "worker: refused: %s\n", refusal->why.c_str());
                refused_ = true;
            }
            worker_.receive(m.header, std::move(m.message));
        }
    }
    void step() {
        const double waited = seconds_since(idle_since_), factor = worker_.slowing();
        const Clock::time_point start = Clock::now();
        worker_.step();
        const double worked = seconds_since(start);
        if (factor > 1) sleep_for((factor - 1) * worked);
        const double processor = processor_s();
        worker_.end_step({std::max(factor, 1.0) * worked, waited,
                          processor - std::exchange(reported_processor_s_, processor)});
        idle_since_ = Clock::now();
    }
    [[nodiscard]] double processor_s() const {
        return threads_ == 1 ? thread_processor_s() : process_processor_s();
    }
    void send_all() {
        for (const std::vector<std::uint8_t>& message : worker_.outgoing()) send(message);
    }
    /// The application may be busy with pictures; then sending waits.
    void send(const std::vector<std::uint8_t>& bytes) {
        while (!through_signals([&] { return socket_.send(zmq::buffer(bytes), zmq::send_flags::none); }))
            if (heartbeat_.application_gone()) return;
    }
    /// Until a message or a signal comes, or the application has to be checked.
    void wait() {
        zmq::pollitem_t item = {socket_.handle(), 0, ZMQ_POLLIN, 0};
        try {
            zmq::poll(&item, 1, std::chrono::milliseconds(kPollMs));
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }

    zmq::socket_t& socket_;
    Heartbeat& heartbeat_;
    int threads_;  ///< of a step
    SharedWorldWorker worker_;
    std::uint32_t number_;
    bool draining_ = false, refused_ = false;
    Clock::time_point idle_since_ = Clock::now();
    /// Time of the offer whose answer the next step waits for.
    std::optional<Clock::time_point> offered_since_;
    double reported_processor_s_ = processor_s();
};

}  // namespace

int serve_world(zmq::socket_t& socket, Heartbeat& heartbeat, int threads, const SceneMessage& scene) {
    heartbeat.joined(scene.worker);
    WorldService service(socket, heartbeat, threads, scene);
    try {
        return service.serve();
    } catch (const std::exception& e) {
        service.report_failure(e.what());
        throw;
    }
}

}  // namespace sim
