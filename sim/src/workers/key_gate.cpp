#include "workers/key_gate.h"

#include <algorithm>
#include <array>

#include "workers/signal_mask.h"

namespace sim {
namespace {

// Two of the envelope; version, id, domain, address, identity, mechanism, key.
constexpr std::size_t kRequestFrames = 9, kIdAt = 3, kMechanismAt = 7, kKeyAt = 8;
constexpr std::size_t kMostKeysWaiting = 1000;
constexpr int kKeyLookMs = 50;

std::string bytes_of(const std::string& key) {
    std::array<std::uint8_t, 32> bytes{};
    zmq_z85_decode(bytes.data(), key.c_str());
    return {bytes.begin(), bytes.end()};
}

}  // namespace

KeyGate::KeyGate(zmq::context_t& context, const std::vector<std::string>& allowed,
                 std::chrono::milliseconds patience)
    : patience_(patience), socket_(context, zmq::socket_type::router) {
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

void KeyGate::allow(const std::string& key) {
    const std::lock_guard lock(mutex_);
    allowed_.push_back(bytes_of(key));
}

void KeyGate::disallow(const std::string& key) {
    const std::lock_guard lock(mutex_);
    if (const auto found = std::ranges::find(allowed_, bytes_of(key)); found != allowed_.end())
        allowed_.erase(found);
}

void KeyGate::serve(const std::stop_token& stop) {
    block_signals();
    while (!stop.stop_requested()) {
        try {
            Frames request(1);
            if (socket_.recv(request.back())) {
                while (request.back().more()) (void)socket_.recv(request.emplace_back());
                take(std::move(request));
            }
            const auto now = std::chrono::steady_clock::now();
            std::erase_if(waiting_, [&](const Waiting& waiting) {
                const bool known = knows(waiting.request), ends = known || now > waiting.until;
                if (ends) answer(waiting.request, known);
                return ends;
            });
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) return;  // the context is going
        }
    }
}

void KeyGate::take(Frames&& request) {
    const bool known = knows(request);
    if (known || patience_.count() == 0 || waiting_.size() >= kMostKeysWaiting)
        answer(request, known);
    else
        waiting_.push_back({std::move(request), std::chrono::steady_clock::now() + patience_});
}

bool KeyGate::knows(const Frames& request) {
    if (request.size() != kRequestFrames || request[kMechanismAt].to_string_view() != "CURVE") return false;
    const std::lock_guard lock(mutex_);
    return std::ranges::find(allowed_, request[kKeyAt].to_string_view()) != allowed_.end();
}

// 300: for now; the peer tries again. 400: never.
void KeyGate::answer(const Frames& request, bool known) {
    refused_ += !known;
    if (request.size() <= kIdAt) return;
    const char* status = known ? "200" : patience_.count() > 0 ? "300" : "400";
    const std::array<std::string, 8> reply = {
        request[0].to_string(),       "", "1.0", request[kIdAt].to_string(), status,
        known ? "OK" : "no such key", "", ""};
    for (std::size_t i = 0; i < reply.size(); ++i)
        socket_.send(zmq::buffer(reply[i]),
                     i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
}

}  // namespace sim
