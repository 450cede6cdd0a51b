#include "workers/worker_gate.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "sim/errors.h"
#include "workers/signals.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kPoll = 20ms, kPollWhenListening = 5ms;  // hundreds of connections may come meanwhile
constexpr auto kLastWords = 300ms;
constexpr auto kGateBeatEvery = 100ms;
// After a longer gap between two checks this process was paused, and the workers were not silent.
constexpr auto kPaused = 250ms;
constexpr int kFramesBetweenChecks = 1000;
constexpr std::size_t kMostEventsWaiting = 4096, kMostBytesWaiting = 64 << 20;
constexpr std::size_t kLargestOfAStranger = 4096;
constexpr double kMostJoinsAtOnce = 256, kJoinsPerSecond = 4;
constexpr int kReceivedAhead = 200;  // messages of a connection that wait in the socket
constexpr auto kHandshakeWithin = 5s;

constexpr std::uint16_t kBeat = 2;

bool is_ours(const zmq::message_t& frame) {
    return frame.size() >= 12 && frame.to_string_view().starts_with("MWSW");
}
bool is_beat(const zmq::message_t& frame) {
    std::uint16_t found = 0;
    if (is_ours(frame)) std::memcpy(&found, frame.data<std::uint8_t>() + 6, sizeof found);
    return found == kBeat;
}

DecodedMessage decoded(const zmq::message_t& frame) {
    return decode_message({frame.data<std::uint8_t>(), frame.size()});
}

zmq::message_t framed(const WorkerMessage& message) {
    const std::vector<std::uint8_t> bytes = encode(MessageHeader{}, message);
    return {bytes.data(), bytes.size()};
}

}  // namespace

WorkerGate::WorkerGate(const Settings& settings)
    : silence_(settings.silence_s),
      router_(context_, zmq::socket_type::router),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!settings.listen.empty()) check_endpoint(settings.listen, settings.keys.has_value());
    bind(settings);
    may_join_ = kMostJoinsAtOnce;
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

// Options apply to endpoints that are bound after them. The private folder's socket is bound first, as it
// needs no keys.
void WorkerGate::bind(const Settings& settings) {
    router_.set(zmq::sockopt::linger, 1000);
    router_.set(zmq::sockopt::sndhwm, settings.most_waiting);
    router_.set(zmq::sockopt::rcvhwm, kReceivedAhead);
    router_.set(zmq::sockopt::maxmsgsize, settings.largest_message);
    router_.set(zmq::sockopt::handshake_ivl,
                static_cast<int>(std::chrono::milliseconds(kHandshakeWithin).count()));
    router_.set(zmq::sockopt::router_mandatory, true);
    if (settings.in_folder) router_.bind(folder_.emplace().endpoint());
    if (!settings.listen.empty()) listen_at(settings);
}

void WorkerGate::listen_at(const Settings& settings) {
    if (settings.keys) {
        keys_ = std::make_unique<KeyGate>(context_, settings.keys->allowed);
        router_.set(zmq::sockopt::zap_domain, KeyGate::kDomain);
        router_.set(zmq::sockopt::curve_server, true);
        router_.set(zmq::sockopt::curve_secretkey, settings.keys->pair.secret);
    }
    std::string listen = settings.listen;
    if (listen.ends_with(":0")) listen.replace(listen.size() - 1, 1, "*");
    router_.set(zmq::sockopt::ipv6, listen.find('[') != std::string::npos);
    try {
        listening_.emplace(context_, router_, listen);
    } catch (const zmq::error_t& e) {
        throw InputError("cannot listen at " + settings.listen + ": " + e.what() +
                         "; choose a free port of an address of this machine (a number, not a name)");
    }
    endpoint_ = router_.get(zmq::sockopt::last_endpoint);
}

WorkerGate::~WorkerGate() {
    thread_.request_stop();
    thread_.join();
    close(wake_);
    router_.close();
}

// Calls of the application's thread.

std::deque<WorkerGate::Event> WorkerGate::wait(std::chrono::milliseconds most) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, most, [this] { return !events_.empty(); });
    waiting_bytes_ = 0;
    if (std::exchange(full_, false)) (void)eventfd_write(wake_, 1);
    return std::exchange(events_, {});
}

void WorkerGate::enqueue(Command&& command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
    if (commands_.size() == 1) (void)eventfd_write(wake_, 1);
}

void WorkerGate::expect(const Secret& secret) {
    const std::lock_guard lock(mutex_);
    expected_.push_back(secret);
}
void WorkerGate::admit(const std::string& stranger, std::uint32_t worker, const Secret& secret) {
    enqueue([this, stranger, worker, secret] {
        members_[worker] = {stranger, Clock::now(), false, {}, secret};
        numbers_[stranger] = worker;
    });
}
void WorkerGate::refuse(const std::string& stranger, const std::string& why) {
    enqueue([this, stranger, why] {
        zmq::message_t frame = framed(Refusal{why});
        send_to(stranger, frame);
    });
}
void WorkerGate::send(const std::vector<std::uint32_t>& workers, Bytes bytes) {
    enqueue([this, workers, bytes = std::move(bytes)] { send_now(workers, *bytes); });
}
void WorkerGate::dismiss(std::uint32_t worker) {
    enqueue([this, worker] {
        const auto found = members_.find(worker);
        if (found == members_.end()) return;
        numbers_.erase(found->second.identity);
        members_.erase(found);
    });
}

// The gate's thread.

void WorkerGate::serve(const std::stop_token& stop) {
    block_signals();
    while (!stop.stop_requested()) {
        poll();
        execute_commands();
        receive();
        check_silence();
        send_unrequested_beats();
        if (listening_) listening_->update();
    }
    execute_commands();
}

void WorkerGate::poll() {
    std::array<zmq::pollitem_t, 2> items = {
        {{nullptr, wake_, ZMQ_POLLIN, 0}, {router_.handle(), 0, ZMQ_POLLIN, 0}}};
    try {
        zmq::poll(items.data(), held_back_ ? 1 : items.size(), listening_ ? kPollWhenListening : kPoll);
    } catch (const zmq::error_t& e) {
        if (e.num() != EINTR) throw;
    }
}

void WorkerGate::execute_commands() {
    std::vector<Command> commands;
    {
        const std::lock_guard lock(mutex_);
        commands.swap(commands_);
        eventfd_t count = 0;
        (void)eventfd_read(wake_, &count);
    }
    for (const Command& command : commands) command();
}

void WorkerGate::send_now(const std::vector<std::uint32_t>& workers, const std::vector<std::uint8_t>& bytes) {
    const zmq::message_t whole(bytes.data(), bytes.size());
    for (const std::uint32_t worker : workers) {
        const auto found = members_.find(worker);
        if (found == members_.end() || found->second.lost || found->second.broken) continue;
        zmq::message_t frame;
        frame.copy(const_cast<zmq::message_t&>(whole));  // shares the bytes
        // The member may have left in order, and its message that says so is on its way.
        if (!send_to(found->second.identity, frame)) found->second.broken = Clock::now();
    }
}

bool WorkerGate::send_to(const std::string& identity, zmq::message_t& frame) {
    try {
        return router_.send(zmq::buffer(identity), zmq::send_flags::sndmore | zmq::send_flags::dontwait) &&
               router_.send(frame, zmq::send_flags::dontwait);
    } catch (const zmq::error_t&) {  // gone
        return false;
    }
}

void WorkerGate::receive() {
    zmq::message_t identity, frame;
    for (int i = 0; i < kFramesBetweenChecks; ++i) {
        {
            const std::lock_guard lock(mutex_);
            held_back_ = full_;
        }
        if (held_back_ || !router_.recv(identity, zmq::recv_flags::dontwait)) return;
        bool single = identity.more() && router_.recv(frame, zmq::recv_flags::dontwait).has_value();
        for (; single && frame.more(); (void)router_.recv(frame, zmq::recv_flags::dontwait)) single = false;
        while (!single && frame.more() && router_.recv(frame, zmq::recv_flags::dontwait)) {
        }
        if (single)
            handle(identity.to_string(), frame);
        else
            ++refused_messages_;
    }
}

void WorkerGate::handle(std::string&& identity, const zmq::message_t& frame) {
    if (is_beat(frame)) return handle_beat(identity, frame);
    const auto known = numbers_.find(identity);
    if (known == numbers_.end()) return handle_stranger(std::move(identity), frame);
    Member& member = members_.at(known->second);
    member.received_at = Clock::now();
    if (member.lost) return;
    const auto* bytes = frame.data<std::uint8_t>();
    Event event;
    event.worker = known->second;
    event.bytes.assign(bytes, bytes + frame.size());
    post(std::move(event));
}

void WorkerGate::handle_beat(const std::string& identity, const zmq::message_t& frame) {
    try {
        const DecodedMessage m = decoded(frame);
        const Secret secret = std::get<Beat>(m.message).secret;
        const auto found = std::find_if(members_.begin(), members_.end(), [&secret](const auto& member) {
            return member.second.secret == secret && secret != Secret{};
        });
        if (found == members_.end()) {  // a former member gets a refusal for its next other message
            refused_messages_ += members_.count(m.header.worker);
            return;
        }
        found->second.received_at = Clock::now();
        found->second.beats_from = identity;
        zmq::message_t answer = framed(Beat{});
        send_to(identity, answer);
    } catch (const DecodeError&) {
        ++refused_messages_;
    }
}

void WorkerGate::handle_stranger(std::string&& identity, const zmq::message_t& frame) {
    const char* why = "not a member, or given up";
    try {
        if (frame.size() > kLargestOfAStranger) throw DecodeError("a stranger's message that is too long");
        DecodedMessage m = decoded(frame);
        if (auto* request = std::get_if<JoinRequest>(&m.message)) {
            if (may_join(request->secret)) {
                Event event;
                event.kind = Event::Kind::asks_to_join;
                event.stranger = std::move(identity), event.request = std::move(*request);
                return post(std::move(event));
            }
            why = "too many workers ask to join; try again later";
        }
    } catch (const DecodeError&) {
        ++refused_messages_;
        return;
    }
    ++refused_messages_;
    zmq::message_t answer = framed(Refusal{why});
    send_to(identity, answer);
}

bool WorkerGate::may_join(const Secret& secret) {
    {
        const std::lock_guard lock(mutex_);
        if (std::find(expected_.begin(), expected_.end(), secret) != expected_.end()) return true;
    }
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> passed = now - std::exchange(counted_joins_, now);
    may_join_ = std::min(kMostJoinsAtOnce, may_join_ + kJoinsPerSecond * passed.count());
    if (may_join_ < 1) return false;
    --may_join_;
    return true;
}

/// Sends heartbeats while nothing is received, so that no worker takes the application for gone.
void WorkerGate::send_unrequested_beats() {
    if (!held_back_ || Clock::now() - sent_beats_ < kGateBeatEvery) return;
    sent_beats_ = Clock::now();
    for (auto& [worker, member] : members_) {
        if (member.lost || member.beats_from.empty()) continue;
        zmq::message_t beat = framed(Beat{});
        send_to(member.beats_from, beat);
    }
}

void WorkerGate::check_silence() {
    const Clock::time_point now = Clock::now();
    const bool paused = now - std::exchange(checked_, now) > kPaused || held_back_;
    for (auto& [worker, member] : members_) {
        if (paused) member.received_at = now;
        if (member.lost) continue;
        if (member.broken && now - *member.broken > kLastWords)
            lose(worker, member, "its link broke");
        else if (now - member.received_at > silence_)
            lose(worker, member, "silent for too long");
    }
}

void WorkerGate::lose(std::uint32_t worker, Member& member, const std::string& why) {
    member.lost = true;
    Event event;
    event.kind = Event::Kind::lost, event.worker = worker, event.why = why;
    post(std::move(event));
}

void WorkerGate::post(Event&& event) {
    const std::lock_guard lock(mutex_);
    waiting_bytes_ += event.bytes.size();
    events_.push_back(std::move(event));
    full_ = events_.size() >= kMostEventsWaiting || waiting_bytes_ >= kMostBytesWaiting;
    came_.notify_one();
}

}  // namespace sim
