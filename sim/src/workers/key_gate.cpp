#include "workers/key_gate.h"

#include <algorithm>
#include <array>

#include "workers/signal_mask.h"

namespace sim {
namespace {

constexpr std::size_t kRequestFrames = 7;  // version, id, domain, address, identity, mechanism, key
constexpr int kKeyLookMs = 50;

std::string bytes_of(const std::string& key) {
    std::array<std::uint8_t, 32> bytes{};
    zmq_z85_decode(bytes.data(), key.c_str());
    return {bytes.begin(), bytes.end()};
}

}  // namespace

KeyGate::KeyGate(zmq::context_t& context, const std::vector<std::string>& allowed)
    : socket_(context, zmq::socket_type::rep) {
    for (const std::string& key : allowed) allowed_.push_back(bytes_of(key));
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvtimeo, kKeyLookMs);
    socket_.bind("inproc://zeromq.zap.01");
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

KeyGate::~KeyGate() {
    thread_.request_stop();
    thread_.join();
}

void KeyGate::serve(const std::stop_token& stop) {
    block_signals();
    while (!stop.stop_requested()) {
        try {
            std::vector<zmq::message_t> request(1);
            if (!socket_.recv(request.back())) continue;
            while (request.back().more()) (void)socket_.recv(request.emplace_back());
            answer(request);
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) return;  // the context is going
        }
    }
}

void KeyGate::answer(std::vector<zmq::message_t>& request) {
    const bool curve = request.size() == kRequestFrames && request[5].to_string_view() == "CURVE";
    const bool known =
        curve && std::find(allowed_.begin(), allowed_.end(), request[6].to_string_view()) != allowed_.end();
    refused_ += !known;
    const std::string id = request.size() > 1 ? request[1].to_string() : "";
    const std::array<std::string, 6> reply = {"1.0", id, known ? "200" : "400", known ? "OK" : "no such key",
                                              "",    ""};
    for (std::size_t i = 0; i < reply.size(); ++i)
        socket_.send(zmq::buffer(reply[i]),
                     i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
}

}  // namespace sim
