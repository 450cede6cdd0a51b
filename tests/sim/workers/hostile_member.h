#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "messages/worker_messages.h"
#include "shared/shared_world_worker.h"
#include "workers/heartbeat.h"

namespace sim_test {

/// A worker of a world that is honest for some steps, then does the one thing over and over while its heart goes
/// on beating. On a thread; ends with the object.
class HostileMember {
public:
    enum class Habit {
        republishes,   ///< its last states, every 100 ms
        offers,        ///< bodies to worker 0, as fast as they go out
        says_nothing,  ///< but heartbeats: it answers no offer
        is_silent      ///< nothing, and no heartbeats
    };
    HostileMember(const std::string& endpoint, Habit habit, int honest_steps,
                  const std::optional<sim::WorkerKeys>& keys = {})
        : habit_(habit),
          honest_steps_(honest_steps),
          thread_([this, endpoint, keys](const std::stop_token& stop) { live(endpoint, keys, stop); }) {}
    [[nodiscard]] bool given_up() const { return given_up_; }  ///< it was told so

private:
    using Clock = std::chrono::steady_clock;

    void live(const std::string& endpoint, const std::optional<sim::WorkerKeys>& keys,
              const std::stop_token& stop) {
        zmq::socket_t socket = sim::connect_worker(context_, endpoint, keys, 0);
        zmq::socket_t beats = sim::connect_worker(context_, endpoint, keys, 0);
        socket.set(zmq::sockopt::rcvtimeo, 2);
        const sim::Secret secret = sim::make_secret();
        send(socket, sim::encode({}, sim::JoinRequest{secret, "hostile"}));
        Clock::time_point beaten{};
        while (!stop.stop_requested()) {
            take(socket);
            if (!worker_) continue;
            const bool honest = steps_ < honest_steps_;
            if ((honest || habit_ != Habit::is_silent) &&
                Clock::now() - beaten > std::chrono::milliseconds(50)) {
                send(beats, sim::encode({number_, 0, 0}, sim::Beat{secret}));
                beaten = Clock::now();
            }
            honest ? serve(socket) : be_hostile(socket);
        }
    }
    static void send(zmq::socket_t& socket, const std::vector<std::uint8_t>& bytes) {
        (void)socket.send(zmq::buffer(bytes), zmq::send_flags::dontwait);
    }
    void take(zmq::socket_t& socket) {
        zmq::message_t frame;
        if (!socket.recv(frame)) return;
        const auto* bytes = frame.data<std::uint8_t>();
        sim::DecodedMessage m = sim::decode_message({bytes, frame.size()});
        given_up_ = given_up_ || std::holds_alternative<sim::Refusal>(m.message);
        if (const auto* scene = std::get_if<sim::SceneMessage>(&m.message)) {
            number_ = scene->worker;
            worker_.emplace(*scene);
        } else if (worker_) {
            worker_->receive(m.header, std::move(m.message));
        }
    }
    void serve(zmq::socket_t& socket) {
        if (worker_->ready()) {
            worker_->step();
            worker_->end_step({.seconds = 1e-3});
            ++steps_;
        }
        for (std::vector<std::uint8_t>& bytes : worker_->outgoing()) {
            send(socket, bytes);
            if (std::holds_alternative<sim::UpdateMessage>(sim::decode_message(bytes).message))
                states_ = std::move(bytes);
        }
    }
    void be_hostile(zmq::socket_t& socket) {
        if (habit_ == Habit::republishes) {
            send(socket, states_);
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        } else if (habit_ == Habit::offers) {
            const sim::Offer offer{0, 1, std::vector<std::uint32_t>(1000, 0), std::vector<float>(1000, 0.1F)};
            for (int i = 0; i < 100; ++i) send(socket, sim::encode({number_, 0, 0}, offer));
        }
    }

    zmq::context_t context_;
    const Habit habit_;
    const int honest_steps_;
    int steps_ = 0;
    std::uint32_t number_ = 0;
    std::optional<sim::SharedWorldWorker> worker_;
    std::vector<std::uint8_t> states_;
    std::atomic<bool> given_up_ = false;
    std::jthread thread_;  // last: starts when the rest is there
};

}  // namespace sim_test
