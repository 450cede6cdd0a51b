#include "update_throughput.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include "bench_clock.h"
#include "workers/heartbeat.h"
#include "workers/worker_gate.h"

namespace sim_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
constexpr std::uint64_t kAhead = 64;  // messages under way at most
constexpr std::uint32_t kSender = 0, kReceiver = 1;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

sim::UpdateMessage updates(const ThroughputSettings& settings) {
    sim::UpdateMessage message;
    for (int b = 0; b < settings.bodies; ++b) {
        sim::Update u;
        u.body = static_cast<std::uint32_t>(b);
        u.state.position = Eigen::Vector3d(0.1 * b, 1, -0.2 * b);
        u.state.orientation = Eigen::Quaterniond(1, 0.01 * b, 0.3, -0.2).normalized();
        u.state.velocity = Eigen::Vector3d(0.3, -0.01 * b, 2);
        u.state.angular_momentum = Eigen::Vector3d(1e-3 * b, 0.2, -0.1);
        u.state.q = Eigen::VectorXd::LinSpaced(settings.modes, -0.01, 0.02);
        u.state.q_dot = Eigen::VectorXd::LinSpaced(settings.modes, -1, 0.5);
        message.bodies.push_back(u);
    }
    return message;
}

template <typename Work>
double ns_each(int bodies, const Work& work) {
    const Clock::time_point start = Clock::now();
    std::uint64_t done = 0;
    for (; seconds_since(start) < 0.2; ++done) work();
    return seconds_since(start) * 1e9 / (double(done) * bodies);
}

struct Keys {
    sim::KeyPair application = sim::make_key_pair(), sender = sim::make_key_pair(),
                 receiver = sim::make_key_pair();
};

struct Shared {
    std::atomic<std::uint64_t> sent = 0, received = 0;
    std::atomic<bool> stop = false;
};

/// Encodes and sends as fast as the receiver takes them.
void send_updates(zmq::socket_t& socket, const sim::WorkerMessage& message, Shared& shared) {
    for (std::uint64_t step = 0; !shared.stop;) {
        if (shared.sent - shared.received >= kAhead) {
            std::this_thread::sleep_for(20us);
            continue;
        }
        (void)socket.send(zmq::buffer(sim::encode({kSender, 0, ++step}, message)), zmq::send_flags::none);
        ++shared.sent;
    }
}

void receive_updates(zmq::socket_t& socket, Shared& shared) {
    socket.set(zmq::sockopt::rcvtimeo, 50);
    zmq::message_t frame;
    while (!shared.stop) {
        if (!socket.recv(frame) || frame.size() < 100) continue;  // a ROUTER's frame of the identity
        (void)sim::decode_message({frame.data<std::uint8_t>(), frame.size()});
        ++shared.received;
    }
}

Throughput measured(const Shared& shared, const ThroughputSettings& settings) {
    while (shared.received < 10) std::this_thread::sleep_for(1ms);
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = shared.received;
    const double cpu = process_cpu_s();
    std::this_thread::sleep_for(std::chrono::duration<double>(settings.seconds));
    const double bodies = double(shared.received - before) * settings.bodies;
    Throughput t;
    t.updates_per_s = bodies / seconds_since(start);
    t.cpu_ns_per_update = (process_cpu_s() - cpu) * 1e9 / bodies;
    return t;
}

/// The sender is connected to a worker that listens: ROUTER, as the application has.
Throughput in_one_hop(const ThroughputSettings& settings, const sim::WorkerMessage& message) {
    const Keys keys;
    zmq::context_t there, here;
    zmq::socket_t receiver(there, zmq::socket_type::router);
    receiver.set(zmq::sockopt::linger, 0);
    if (settings.keys) {
        receiver.set(zmq::sockopt::curve_server, true);
        receiver.set(zmq::sockopt::curve_secretkey, keys.application.secret);
    }
    receiver.bind("tcp://127.0.0.1:*");
    std::optional<sim::WorkerKeys> own;
    if (settings.keys) own = {keys.sender, keys.application.shown};
    zmq::socket_t sender = sim::connect_worker(here, receiver.get(zmq::sockopt::last_endpoint), own, 0);
    Shared shared;
    const std::jthread sends([&] { send_updates(sender, message, shared); });
    const std::jthread receives([&] { receive_updates(receiver, shared); });
    const Throughput t = measured(shared, settings);
    shared.stop = true;
    return t;
}

/// Passes everything that the sender sends on to the receiver, as the application does.
void pass_on(sim::WorkerGate& gate, Shared& shared) {
    while (!shared.stop) {
        for (sim::WorkerGate::Event& event : gate.wait(20ms)) {
            using Kind = sim::WorkerGate::Event::Kind;
            if (event.kind == Kind::asks_to_join)
                gate.admit(event.stranger, event.request.secret[0], event.request.secret);
            if (event.kind == Kind::message)
                gate.send({kReceiver},
                          std::make_shared<const std::vector<std::uint8_t>>(std::move(event.bytes)));
        }
    }
}

Throughput through_application(const ThroughputSettings& settings, const sim::WorkerMessage& message) {
    const Keys keys;
    sim::WorkerGate::Settings open{"tcp://127.0.0.1:*", std::nullopt, 3600};
    open.most_waiting = 100'000;
    std::optional<sim::WorkerKeys> one, other;
    if (settings.keys) {
        open.keys = {keys.application, {keys.sender.shown, keys.receiver.shown}};
        one = {keys.sender, keys.application.shown}, other = {keys.receiver, keys.application.shown};
    }
    sim::WorkerGate gate(open);
    zmq::context_t here, there;
    zmq::socket_t sender = sim::connect_worker(here, gate.endpoint(), one, 0);
    zmq::socket_t receiver = sim::connect_worker(there, gate.endpoint(), other, 0);
    (void)receiver.send(zmq::buffer(sim::encode({}, sim::JoinRequest{{kReceiver}, ""})),
                        zmq::send_flags::none);
    (void)sender.send(zmq::buffer(sim::encode({}, sim::JoinRequest{{kSender}, ""})), zmq::send_flags::none);
    Shared shared;
    const std::jthread passes([&] { pass_on(gate, shared); });
    std::this_thread::sleep_for(200ms);  // both are members
    const std::jthread sends([&] { send_updates(sender, message, shared); });
    const std::jthread receives([&] { receive_updates(receiver, shared); });
    const Throughput t = measured(shared, settings);
    shared.stop = true;
    return t;
}

}  // namespace

Throughput measure_update_throughput(const ThroughputSettings& settings) {
    const sim::WorkerMessage message = updates(settings);
    const std::vector<std::uint8_t> bytes = sim::encode({}, message);
    Throughput t =
        settings.through_application ? through_application(settings, message) : in_one_hop(settings, message);
    t.bytes_per_update = double(bytes.size()) / settings.bodies;
    t.encode_ns = ns_each(settings.bodies, [&] { (void)sim::encode({}, message); });
    t.decode_ns = ns_each(settings.bodies, [&] { (void)sim::decode_message(bytes); });
    return t;
}

}  // namespace sim_bench
