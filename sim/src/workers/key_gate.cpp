#include "workers/key_gate.h"

#include <algorithm>
#include <array>

#include "workers/signals.h"

namespace sim {
namespace {

// Two frames of the envelope, then version, id, domain, address, identity, mechanism, key.
constexpr std::size_t kRequestFrames = 9, kIdAt = 3, kMechanismAt = 7, kKeyAt = 8;
constexpr int kKeyLookMs = 50;

std::string bytes_of(const std::string& key) {
    std::array<std::uint8_t, 32> bytes{};
    zmq_z85_decode(bytes.data(), key.c_str());
    return {bytes.begin(), bytes.end()};
}

}  // namespace

KeyGate::KeyGate(zmq::context_t& context, const std::vector<std::string>& allowed)
    : socket_(context, zmq::socket_type::router) {
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
            Frames request(1);
            if (!socket_.recv(request.back())) continue;
            while (request.back().more()) (void)socket_.recv(request.emplace_back());
            answer(request);
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) return;  // the context ends
        }
    }
}

bool KeyGate::is_allowed(const Frames& request) const {
    if (request.size() != kRequestFrames || request[kMechanismAt].to_string_view() != "CURVE") return false;
    return std::ranges::find(allowed_, request[kKeyAt].to_string_view()) != allowed_.end();
}

void KeyGate::answer(const Frames& request) {
    const bool allowed = is_allowed(request);
    refused_ += !allowed;
    if (request.size() <= kIdAt) return;
    const std::array<std::string, 8> reply = {
        request[0].to_string(),         "", "1.0", request[kIdAt].to_string(), allowed ? "200" : "400",
        allowed ? "OK" : "no such key", "", ""};
    for (std::size_t i = 0; i < reply.size(); ++i)
        socket_.send(zmq::buffer(reply[i]),
                     i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
}

}  // namespace sim
