#include "workers/worker_gate.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "sim/errors.h"
#include "workers/signal_mask.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kPoll = 20ms, kPollAtDoor = 5ms;  // in which hundreds of connections may come
constexpr auto kLastWords = 300ms;
constexpr auto kBeatUnasked = 100ms;
constexpr auto kPaused = 250ms;  // a longer gap between two looks is ours, not the workers' silence
constexpr int kFramesBetweenLooks = 1000;
constexpr std::size_t kMostEventsWaiting = 4096, kMostBytesWaiting = 64 << 20;
constexpr std::size_t kLargestOfAStranger = 4096;
constexpr double kMostJoinsAtOnce = 256, kJoinsPerSecond = 4;
constexpr int kReceivedAhead = 200;  // messages of a connection that wait in the socket
constexpr auto kHandshakeWithin = 5s;

enum class Type : std::uint16_t { join = 1, beat = 2 };

bool is_ours(const zmq::message_t& frame) {
    return frame.size() >= 12 && frame.to_string_view().starts_with("MWSW");
}
bool is(const zmq::message_t& frame, Type type) {
    std::uint16_t found = 0;
    if (is_ours(frame)) std::memcpy(&found, frame.data<std::uint8_t>() + 6, sizeof found);
    return found == static_cast<std::uint16_t>(type);
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

// Options count for what is bound after them: the private folder's socket needs no keys.
void WorkerGate::bind(const Settings& settings) {
    router_.set(zmq::sockopt::linger, 1000);
    router_.set(zmq::sockopt::sndhwm, settings.most_waiting);
    router_.set(zmq::sockopt::rcvhwm, kReceivedAhead);
    router_.set(zmq::sockopt::maxmsgsize, settings.largest_message);
    router_.set(zmq::sockopt::handshake_ivl,
                static_cast<int>(std::chrono::milliseconds(kHandshakeWithin).count()));
    router_.set(zmq::sockopt::router_mandatory, true);
    if (settings.in_folder) router_.bind(folder_.emplace().endpoint());
    if (!settings.listen.empty()) open_door(settings);
}

void WorkerGate::open_door(const Settings& settings) {
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

void WorkerGate::order(Command&& command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
    if (commands_.size() == 1) (void)eventfd_write(wake_, 1);
}

void WorkerGate::expect(const Secret& secret) {
    const std::lock_guard lock(mutex_);
    expected_.push_back(secret);
}
void WorkerGate::admit(const std::string& stranger, std::uint32_t worker, const Secret& secret) {
    order({Command::Kind::admit, stranger, {}, {worker}, {}, secret});
}
void WorkerGate::refuse(const std::string& stranger, const std::string& why) {
    order({Command::Kind::refuse, stranger, why, {}, {}});
}
void WorkerGate::send(const std::vector<std::uint32_t>& workers, Bytes bytes) {
    order({Command::Kind::send, {}, {}, workers, std::move(bytes)});
}
void WorkerGate::dismiss(std::uint32_t worker) {
    order({Command::Kind::dismiss, {}, {}, {worker}, {}});
}

// The gate's thread.

void WorkerGate::serve(const std::stop_token& stop) {
    block_signals();
    while (!stop.stop_requested()) {
        poll();
        obey();
        receive();
        look_for_silence();
        beat_unasked();
        if (listening_) listening_->look();
    }
    obey();
}

void WorkerGate::poll() {
    std::array<zmq::pollitem_t, 2> items = {
        {{nullptr, wake_, ZMQ_POLLIN, 0}, {router_.handle(), 0, ZMQ_POLLIN, 0}}};
    try {
        zmq::poll(items.data(), held_back_ ? 1 : items.size(), listening_ ? kPollAtDoor : kPoll);
    } catch (const zmq::error_t& e) {
        if (e.num() != EINTR) throw;
    }
}

void WorkerGate::obey() {
    std::vector<Command> commands;
    {
        const std::lock_guard lock(mutex_);
        commands.swap(commands_);
        eventfd_t count = 0;
        (void)eventfd_read(wake_, &count);
    }
    for (const Command& command : commands) obey(command);
}

void WorkerGate::obey(const Command& command) {
    if (command.kind == Command::Kind::refuse) {
        zmq::message_t frame = framed(Refusal{command.why});
        send_to(command.stranger, frame);
    } else if (command.kind == Command::Kind::admit) {
        members_[command.workers[0]] = {command.stranger, Clock::now(), false, {}, command.secret};
        numbers_[command.stranger] = command.workers[0];
    } else if (command.kind == Command::Kind::dismiss) {
        const auto found = members_.find(command.workers[0]);
        if (found == members_.end()) return;
        numbers_.erase(found->second.identity);
        members_.erase(found);
    } else {
        const zmq::message_t whole(command.bytes->data(), command.bytes->size());
        for (const std::uint32_t worker : command.workers) {
            const auto found = members_.find(worker);
            if (found == members_.end() || found->second.lost || found->second.broken) continue;
            zmq::message_t frame;
            frame.copy(const_cast<zmq::message_t&>(whole));  // shares the bytes
            // Who has drained and gone may have said so: that is on its way.
            if (!send_to(found->second.identity, frame)) found->second.broken = Clock::now();
        }
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
    for (int i = 0; i < kFramesBetweenLooks; ++i) {
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
            take(identity.to_string(), frame);
        else
            ++refused_messages_;
    }
}

void WorkerGate::take(std::string&& identity, const zmq::message_t& frame) {
    if (is(frame, Type::beat)) return take_beat(identity, frame);
    const auto known = numbers_.find(identity);
    if (known == numbers_.end()) return take_from_stranger(std::move(identity), frame);
    Member& member = members_.at(known->second);
    member.heard = Clock::now();
    if (member.lost) return;
    const auto* bytes = frame.data<std::uint8_t>();
    Event event;
    event.worker = known->second;
    event.bytes.assign(bytes, bytes + frame.size());
    tell(std::move(event));
}

void WorkerGate::take_beat(const std::string& identity, const zmq::message_t& frame) {
    try {
        const DecodedMessage m = decoded(frame);
        const Secret secret = std::get<Beat>(m.message).secret;
        const auto found = std::find_if(members_.begin(), members_.end(), [&secret](const auto& member) {
            return member.second.secret == secret && secret != Secret{};
        });
        if (found == members_.end()) {  // who is a member no more learns so when it sends something else
            refused_messages_ += members_.count(m.header.worker);
            return;
        }
        found->second.heard = Clock::now();
        found->second.beats_from = identity;
        zmq::message_t answer = framed(Beat{});
        send_to(identity, answer);
    } catch (const DecodeError&) {
        ++refused_messages_;
    }
}

void WorkerGate::take_from_stranger(std::string&& identity, const zmq::message_t& frame) {
    const char* why = "not a member, or given up";
    try {
        if (frame.size() > kLargestOfAStranger) throw DecodeError("a stranger's message that is too long");
        DecodedMessage m = decoded(frame);
        if (auto* request = std::get_if<JoinRequest>(&m.message)) {
            if (may_join(request->secret)) {
                Event event;
                event.kind = Event::Kind::asks_to_join;
                event.stranger = std::move(identity), event.request = std::move(*request);
                return tell(std::move(event));
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

/// While nothing is received, so that no worker takes the application for gone.
void WorkerGate::beat_unasked() {
    if (!held_back_ || Clock::now() - beaten_ < kBeatUnasked) return;
    beaten_ = Clock::now();
    for (auto& [worker, member] : members_) {
        if (member.lost || member.beats_from.empty()) continue;
        zmq::message_t beat = framed(Beat{});
        send_to(member.beats_from, beat);
    }
}

void WorkerGate::look_for_silence() {
    const Clock::time_point now = Clock::now();
    const bool paused = now - std::exchange(looked_, now) > kPaused || held_back_;
    for (auto& [worker, member] : members_) {
        if (paused) member.heard = now;
        if (member.lost) continue;
        if (member.broken && now - *member.broken > kLastWords)
            lose(worker, member, "its link broke");
        else if (now - member.heard > silence_)
            lose(worker, member, "silent for too long");
    }
}

void WorkerGate::lose(std::uint32_t worker, Member& member, const std::string& why) {
    member.lost = true;
    Event event;
    event.kind = Event::Kind::lost, event.worker = worker, event.why = why;
    tell(std::move(event));
}

void WorkerGate::tell(Event&& event) {
    const std::lock_guard lock(mutex_);
    waiting_bytes_ += event.bytes.size();
    events_.push_back(std::move(event));
    full_ = events_.size() >= kMostEventsWaiting || waiting_bytes_ >= kMostBytesWaiting;
    came_.notify_one();
}

}  // namespace sim
