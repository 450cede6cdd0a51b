#include "workers/world_service.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/elapsed.h"
#include "workers/leave_signals.h"
#include "workers/peer_links.h"
#include "workers/through_signals.h"
#include "world/processor_time.h"

namespace sim {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPollMs = 50;
constexpr std::size_t kMostPartsInOneGo = 4096;
constexpr double kLongestWithin = 2;       // that a step waits for others [s]; then it is done alone
constexpr double kLongestForAnswer = 0.5;  // that the next step waits for the answer to an offer [s]
constexpr double kLongestToLeave = 3;      // that who leaves waits until others have heard all [s]

/// Messages that one worker tells another of a step, at most. In bounded pace who has nothing, and does no steps, tells of sales.
std::size_t most_told(const SceneMessage& scene) {
    constexpr std::size_t kMostOfSales = 1 << 16;
    return scene.settings.pace == Pace::lockstep ? most_parts(scene.scene) : kMostOfSales;
}

/// Sleeps through a signal too.
void sleep_for(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

class WorldService {
public:
    WorldService(const WorldLink& link, const SceneMessage& scene)
        : socket_(link.socket),
          pulse_(link.pulse),
          threads_(link.threads),
          worker_(scene),
          header_{scene.worker, 0, 0},
          bounded_(scene.settings.pace == Pace::bounded) {
        worker_.use_threads(threads_);
        if (scene.settings.pace == Pace::lockstep && !scene.settings.together) return;
        links_.emplace(link.context, PeerLinks::Settings{scene.worker, scene.settings.pace, link.endpoint,
                                                         link.keys, largest_message(scene.scene),
                                                         most_told(scene), scene.settings.steps});
        if (links_->reach()) send(encode(header_, *links_->reach()));
    }

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
            if (leave_asked() && !std::exchange(draining_, true)) worker_.drain();
            look_after_offer();
            look_after_others();
            if (!worker_.ended() && worker_.ready()) step();
            send_all();
            if (worker_.left()) return 0;
            if (!worker_.ready()) wait();
        }
        if (pulse_.application_gone()) return 1;
        return refused_ ? 1 : 0;
    }
    /// Who does not answer does not hold up the run.
    void look_after_offer() {
        if (!worker_.awaits_answer())
            offered_since_.reset();
        else if (!offered_since_)
            offered_since_ = Clock::now();
        else if (seconds_since(*offered_since_) > (draining_ ? kLongestToLeave : kLongestForAnswer))
            worker_.stop_waiting_for_answer();
    }
    /// What they told may have been lost, or a link may be cut. (Or a step takes long: then the next message goes by the application.)
    void look_after_others() {
        const Clock::time_point now = Clock::now();
        if (idle_since_ > asked_) ask_after_ = kAskAgain;
        if (worker_.ready() || seconds_since(std::max(idle_since_, asked_)) < ask_after_) return;
        asked_ = now, ask_after_ *= 2;
        if (links_) links_->doubt(now), links_->begin_step();
        worker_.ask_again();
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
            if (links_) follow(m.message);
            if (!std::holds_alternative<PeersMessage>(m.message)) take(std::move(m));
        }
        // A bounded number, so that who floods does not hold this up.
        for (std::size_t i = 0; links_ && i < kMostPartsInOneGo; ++i) {
            std::optional<DecodedMessage> part = links_->receive(Clock::now());
            if (!part) break;
            take(std::move(*part));
        }
        if (links_) links_->look(Clock::now());
    }
    void take(DecodedMessage&& m) {
        try {
            worker_.take(m.header, std::move(m.message));
        } catch (const PeerError& wrong) {
            links_->close(wrong.worker, wrong.what());
        }
    }
    /// What the application says of the other workers.
    void follow(const WorkerMessage& message) {
        if (const auto* peers = std::get_if<PeersMessage>(&message)) links_->add(*peers);
        if (const auto* members = std::get_if<Members>(&message)) links_->keep(members->workers);
    }
    void step() {
        const double waited = seconds_since(idle_since_), factor = worker_.slowing();
        const Clock::time_point start = Clock::now();
        waited_within_ = 0;
        if (links_) links_->begin_step();
        worker_.step([this](bool wait) { flush(wait); });
        if (links_ && worker_.was_alone()) links_->doubt(Clock::now());
        const double worked = seconds_since(start) - waited_within_;
        if (factor > 1) sleep_for((factor - 1) * worked);
        const double processor = processor_s();
        const std::uint64_t linked = links_ ? links_->sent() : 0;
        worker_.worked({std::max(factor, 1.0) * worked, waited + waited_within_,
                        processor - std::exchange(told_processor_, processor),
                        linked - std::exchange(told_linked_, linked)});
        idle_since_ = Clock::now();
    }
    [[nodiscard]] double processor_s() const {
        return threads_ == 1 ? thread_processor_s() : process_processor_s();
    }
    /// Within a step: until something came, or what others do not tell has been waited for long enough.
    void flush(bool must_wait) {
        send_all();
        if (!must_wait) return;
        const Clock::time_point start = Clock::now();
        wait();
        if (pulse_.application_gone()) throw Gone{};
        take_all();
        waited_within_ += seconds_since(start);
        if (waited_within_ < kLongestWithin) return;
        worker_.stop_waiting();
    }
    void send_all() {
        if (links_ && bounded_) links_->begin_step();  // messages have numbers: each may go either way
        for (SharedWorldWorker::Outgoing& message : worker_.outgoing()) {
            if (message.to.empty()) {
                send(message.bytes);
                continue;
            }
            if (links_ && !message.by_application) message.to = links_->send(message.to, message.bytes);
            if (!message.to.empty()) send(worker_.relayed(std::move(message.to), std::move(message.bytes)));
        }
    }
    /// The application may be busy, with pictures, and take what it can.
    void send(const std::vector<std::uint8_t>& bytes) {
        while (!through_signals([&] { return socket_.send(zmq::buffer(bytes), zmq::send_flags::none); }))
            if (pulse_.application_gone()) return;
    }
    /// Until something comes, or a signal, or a look at the application is due.
    void wait() {
        std::array<zmq::pollitem_t, 2> items = {
            {{socket_.handle(), 0, ZMQ_POLLIN, 0}, {links_ ? links_->handle() : nullptr, 0, ZMQ_POLLIN, 0}}};
        try {
            zmq::poll(items.data(), links_ ? 2 : 1, std::chrono::milliseconds(kPollMs));
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }

    zmq::socket_t& socket_;
    Pulse& pulse_;
    int threads_;  ///< of a step
    SharedWorldWorker worker_;
    std::optional<PeerLinks> links_;  ///< none with --verify
    std::uint64_t told_linked_ = 0;   ///< of what was sent on them [bytes]
    MessageHeader header_;
    bool bounded_, draining_ = false, refused_ = false;
    double waited_within_ = 0;  ///< the step under way
    Clock::time_point idle_since_ = Clock::now(), asked_ = idle_since_;
    double ask_after_ = kAskAgain;                    ///< [s]; twice as long each time
    std::optional<Clock::time_point> offered_since_;  ///< the offer whose answer the next step waits for
    double told_processor_ = processor_s();
};

}  // namespace

int serve_world(const WorldLink& link, const SceneMessage& scene) {
    link.pulse.joined(scene.worker);
    WorldService service(link, scene);
    try {
        return service.serve();
    } catch (const std::exception& e) {
        service.report(e.what());
        throw;
    }
}

}  // namespace sim
