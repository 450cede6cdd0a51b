#include "workers/world_service.h"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>

#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/elapsed.h"
#include "workers/leave_signals.h"
#include "run/processor_time.h"

namespace sim {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPollMs = 50;
constexpr double kLongestForAnswer = 0.5;  // that the next step waits for the answer to an offer [s]

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
    WorldService(zmq::socket_t& socket, Pulse& pulse, int threads, const SceneMessage& scene)
        : socket_(socket), pulse_(pulse), threads_(threads), worker_(scene), number_(scene.worker) {
        worker_.use_threads(threads_);
    }

    int serve() {
        while (!worker_.ended() && !pulse_.application_gone()) {
            take_all();
            if (leave_asked() && !std::exchange(draining_, true)) worker_.drain();
            look_after_offer();
            if (!worker_.ended() && worker_.ready()) step();
            send_all();
            if (worker_.left()) return 0;
            if (!worker_.ready()) wait();
        }
        return pulse_.application_gone() || refused_ ? 1 : 0;
    }
    void report(const std::string& what) { send(encode({number_, 0, 0}, WorkerFailure{what})); }

private:
    /// Who does not answer does not hold up the run.
    void look_after_offer() {
        if (!worker_.awaits_answer())
            offered_since_.reset();
        else if (!offered_since_)
            offered_since_ = Clock::now();
        else if (seconds_since(*offered_since_) > kLongestForAnswer)
            worker_.stop_waiting_for_answer();
    }
    void take_all() {
        zmq::message_t frame;
        while (through_signals([&] { return socket_.recv(frame, zmq::recv_flags::dontwait); })) {
            const auto* bytes = frame.data<std::uint8_t>();
            DecodedMessage m = decode_message({bytes, frame.size()});
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
        worker_.step();
        const double worked = seconds_since(start);
        if (factor > 1) sleep_for((factor - 1) * worked);
        const double processor = processor_s();
        worker_.worked(
            {std::max(factor, 1.0) * worked, waited, processor - std::exchange(told_processor_, processor)});
        idle_since_ = Clock::now();
    }
    [[nodiscard]] double processor_s() const {
        return threads_ == 1 ? thread_processor_s() : process_processor_s();
    }
    void send_all() {
        for (const std::vector<std::uint8_t>& message : worker_.outgoing()) send(message);
    }
    /// The application may be busy, with pictures, and take what it can.
    void send(const std::vector<std::uint8_t>& bytes) {
        while (!through_signals([&] { return socket_.send(zmq::buffer(bytes), zmq::send_flags::none); }))
            if (pulse_.application_gone()) return;
    }
    /// Until something comes, or a signal, or a look at the application is due.
    void wait() {
        zmq::pollitem_t item = {socket_.handle(), 0, ZMQ_POLLIN, 0};
        try {
            zmq::poll(&item, 1, std::chrono::milliseconds(kPollMs));
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }

    zmq::socket_t& socket_;
    Pulse& pulse_;
    int threads_;  ///< of a step
    SharedWorldWorker worker_;
    std::uint32_t number_;
    bool draining_ = false, refused_ = false;
    Clock::time_point idle_since_ = Clock::now();
    std::optional<Clock::time_point> offered_since_;  ///< the offer whose answer the next step waits for
    double told_processor_ = processor_s();
};

}  // namespace

int serve_world(zmq::socket_t& socket, Pulse& pulse, int threads, const SceneMessage& scene) {
    pulse.joined(scene.worker);
    WorldService service(socket, pulse, threads, scene);
    try {
        return service.serve();
    } catch (const std::exception& e) {
        service.report(e.what());
        throw;
    }
}

}  // namespace sim
