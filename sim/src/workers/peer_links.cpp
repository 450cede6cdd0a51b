#include "workers/peer_links.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <utility>

#include "workers/socket_folder.h"
#include "workers/through_signals.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kLinkBeatEvery = 100ms;
constexpr auto kLinkSilence = 10s;  // of who does a long step
constexpr auto kLinkDoubt = 500ms;
// Until the application has told this one of a peer, too; then that tries again, once the handshake's time is over.
constexpr auto kLinkPatience = 4s, kLinkHandshake = 5s;
constexpr int kMostPartsWaiting = 100, kMostToSend = 20'000;
constexpr int kLinkLingerMs = 200;
constexpr int kReconnectMs = 50, kReconnectMostMs = 2000;
constexpr std::size_t kPreambleBytes = 24;
constexpr std::size_t kMostInOneGo = 256;  // refused or beats

/// The address by which this machine reaches HOST of tcp://HOST:PORT; empty: none that another machine could use.
std::string local_address_to(const std::string& endpoint) {
    const std::size_t colon = endpoint.rfind(':');
    std::string host = endpoint.substr(std::strlen("tcp://"), colon - std::strlen("tcp://"));
    if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
    addrinfo hints{};
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(host.c_str(), endpoint.c_str() + colon + 1, &hints, &found) != 0) return {};
    std::string address;
    for (const addrinfo* at = found; at && address.empty(); at = at->ai_next) {
        // Nothing is sent: this only chooses a route.
        const int probe = socket(at->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_storage own{};
        socklen_t size = sizeof own;
        std::array<char, NI_MAXHOST> name{};
        if (probe >= 0 && connect(probe, at->ai_addr, at->ai_addrlen) == 0 &&
            getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0 &&
            getnameinfo(reinterpret_cast<const sockaddr*>(&own), size, name.data(), name.size(), nullptr, 0,
                        NI_NUMERICHOST) == 0)
            address = name.data();
        if (probe >= 0) close(probe);
    }
    freeaddrinfo(found);
    return address.find('%') == std::string::npos ? address : std::string();
}

/// Whether it is tcp://ADDRESS:PORT by numbers: to look up a name would hold up every socket of this process.
bool is_numeric(const std::string& endpoint) {
    std::string host = endpoint.substr(std::strlen("tcp://"), endpoint.rfind(':') - std::strlen("tcp://"));
    if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
    in6_addr address{};
    return endpoint.back() != '*' && (inet_pton(AF_INET, host.c_str(), &address) == 1 ||
                                      inet_pton(AF_INET6, host.c_str(), &address) == 1);
}

}  // namespace

PeerLinks::PeerLinks(zmq::context_t& context, const Settings& settings)
    : settings_(settings), context_(context), listens_(context, zmq::socket_type::pull) {
    try {
        bind(context);
    } catch (const zmq::error_t&) {
        reach_.reset();  // all is told by way of the application
    }
}

PeerLinks::~PeerLinks() {
    listens_.close();
}

void PeerLinks::bind(zmq::context_t& context) {
    listens_.set(zmq::sockopt::linger, 0);
    listens_.set(zmq::sockopt::rcvhwm, kMostPartsWaiting);
    listens_.set(zmq::sockopt::handshake_ivl,
                 static_cast<int>(std::chrono::milliseconds(kLinkHandshake).count()));
    listens_.set(zmq::sockopt::maxmsgsize, settings_.largest);
    const std::string& application = settings_.application;
    if (application.starts_with("ipc://")) {
        const std::string beside = peer_socket(application);
        if (beside.empty()) return;
        listens_.bind(beside);
        reach_ = {beside, ""};
        return;
    }
    const std::string address = local_address_to(application);
    if (address.empty()) return;
    const bool six = address.find(':') != std::string::npos;
    if (settings_.keys) {
        gate_ = std::make_unique<KeyGate>(context, std::vector<std::string>{}, kLinkPatience);
        listens_.set(zmq::sockopt::zap_domain, KeyGate::kDomain);
        listens_.set(zmq::sockopt::curve_server, true);
        listens_.set(zmq::sockopt::curve_secretkey, settings_.keys->pair.secret);
    }
    listens_.set(zmq::sockopt::ipv6, six);
    listening_.emplace(context, listens_, "tcp://" + (six ? "[" + address + "]" : address) + ":*");
    reach_ = {listens_.get(zmq::sockopt::last_endpoint), settings_.keys ? settings_.keys->pair.shown : ""};
}

// A member that lies must not make others connect to what is none of its.
bool PeerLinks::may_connect(const PeersMessage::Peer& peer) const {
    if (settings_.application.starts_with("ipc://"))
        return is_peer_socket(peer.endpoint, settings_.application);
    if (!peer.endpoint.starts_with("tcp://") || peer.key.empty() != !settings_.keys) return false;
    try {
        check_endpoint(peer.endpoint, settings_.keys.has_value());
    } catch (const std::invalid_argument&) {
        return false;
    }
    return is_numeric(peer.endpoint);
}

void PeerLinks::add(const PeersMessage& message) {
    if (!reach_) return;
    for (const PeersMessage::Peer& peer : message.peers) {
        if (peer.worker == settings_.self || peers_.contains(peer.worker) || !may_connect(peer) ||
            few_descriptors_left())
            continue;
        try {
            connect(peer);
            beat(peers_.at(peer.worker));
        } catch (const zmq::error_t&) {  // it cannot be reached
            who_says_.erase(peer.says);
            peers_.erase(peer.worker);
        }
    }
}

void PeerLinks::connect(const PeersMessage::Peer& peer) {
    Peer& to = peers_[peer.worker];
    to.says = peer.says, to.hears = peer.hears, to.key = peer.key;
    to.socket = zmq::socket_t(context_, zmq::socket_type::push);
    to.socket.set(zmq::sockopt::linger, kLinkLingerMs);  // of who leaves: its last step's parts
    to.socket.set(zmq::sockopt::sndhwm, kMostToSend);
    to.socket.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
    to.socket.set(zmq::sockopt::reconnect_ivl_max, kReconnectMostMs);
    to.socket.set(zmq::sockopt::ipv6, true);
    if (settings_.keys) {
        to.socket.set(zmq::sockopt::curve_serverkey, peer.key);
        to.socket.set(zmq::sockopt::curve_publickey, settings_.keys->pair.shown);
        to.socket.set(zmq::sockopt::curve_secretkey, settings_.keys->pair.secret);
        gate_->allow(peer.key);
    }
    to.socket.connect(peer.endpoint);
    who_says_[peer.says] = peer.worker;
}

void PeerLinks::keep(const std::vector<std::uint32_t>& members) {
    std::erase_if(peers_, [&](const auto& peer) {
        if (std::ranges::find(members, peer.first) != members.end()) return false;
        who_says_.erase(peer.second.says);
        if (gate_) gate_->disallow(peer.second.key);
        return true;
    });
}

bool PeerLinks::is_up(std::uint32_t worker) const {
    const auto peer = peers_.find(worker);
    return peer != peers_.end() && peer->second.heard && peer->second.hears_this && !peer->second.closed;
}

void PeerLinks::look(Clock::time_point now) {
    if (now - beaten_ < kLinkBeatEvery) return;
    beaten_ = now;
    for (auto& [worker, peer] : peers_) {
        if (peer.heard && now - *peer.heard > kLinkSilence) peer.heard.reset();
        beat(peer);
    }
    if (listening_) listening_->look();
}

void PeerLinks::doubt(Clock::time_point now) {
    for (auto& [worker, peer] : peers_)
        if (peer.heard && now - *peer.heard > kLinkDoubt) peer.heard.reset(), beat(peer);
}

void PeerLinks::beat(Peer& peer) {
    const bool hears = peer.heard && !peer.closed;
    const std::vector<std::uint8_t> bytes = encode({settings_.self, 0, 0}, LinkBeat{hears});
    (void)send(peer, zmq::message_t(bytes.data(), bytes.size()));
}

void PeerLinks::begin_step() {
    for (auto& [worker, peer] : peers_) peer.direct = is_up(worker);
}

// What cannot be sent is lost: the other one sees it by the count.
bool PeerLinks::send(Peer& peer, const zmq::message_t& message) {
    std::array<std::uint8_t, kPreambleBytes> preamble{};
    const std::uint64_t count = ++peer.count_sent;
    std::ranges::copy(peer.hears, preamble.begin());
    std::memcpy(preamble.data() + sizeof(Secret), &count, sizeof count);
    zmq::message_t copy;
    copy.copy(const_cast<zmq::message_t&>(message));  // shares the bytes
    using enum zmq::send_flags;
    const auto first = [&] {
        return peer.socket.send(zmq::buffer(preamble), sndmore | dontwait).has_value();
    };
    const auto second = [&] { return peer.socket.send(copy, dontwait).has_value(); };
    return through_signals(first) && through_signals(second);
}

std::vector<std::uint32_t> PeerLinks::send(const std::vector<std::uint32_t>& to,
                                           const std::vector<std::uint8_t>& bytes) {
    std::vector<std::uint32_t> others;
    const zmq::message_t message(bytes.data(), bytes.size());
    for (const std::uint32_t worker : to) {
        const auto peer = peers_.find(worker);
        if (peer == peers_.end() || !peer->second.direct)
            others.push_back(worker);
        else if (send(peer->second, message))
            sent_ += bytes.size() + kPreambleBytes;
    }
    return others;
}

std::optional<DecodedMessage> PeerLinks::receive(Clock::time_point now) {
    zmq::message_t preamble, message;
    const auto next_frame = [this](zmq::message_t& frame) {
        return through_signals([&] { return listens_.recv(frame, zmq::recv_flags::dontwait).has_value(); });
    };
    for (std::size_t i = 0; heard_.empty() && i < kMostInOneGo; ++i) {
        if (!next_frame(preamble)) break;
        bool two = preamble.more() && next_frame(message);
        while (two && message.more() && next_frame(message)) two = false;
        if (two && preamble.size() == kPreambleBytes)
            take(preamble, message, now);
        else
            ++refused_;
    }
    if (heard_.empty()) return std::nullopt;
    DecodedMessage next = std::move(heard_.front());
    heard_.pop_front();
    return next;
}

void PeerLinks::take(const zmq::message_t& preamble, const zmq::message_t& message, Clock::time_point now) {
    Secret secret;
    std::uint64_t count = 0;
    std::memcpy(secret.data(), preamble.data(), secret.size());
    std::memcpy(&count, preamble.data<std::uint8_t>() + secret.size(), sizeof count);
    const auto who = who_says_.find(secret);
    if (who == who_says_.end() || peers_.at(who->second).closed) {
        ++refused_;
        return;
    }
    const std::uint32_t worker = who->second;
    Peer& peer = peers_.at(worker);
    const bool first = !peer.heard;
    peer.heard = now;
    peer.lost = count != std::exchange(peer.count_heard, count) + 1 || peer.lost;
    try {
        read(worker, peer, message);
    } catch (const DecodeError& wrong) {
        close(worker, wrong.what());
    }
    if (first && !peer.closed) beat(peer);
}

void PeerLinks::close(std::uint32_t worker, const std::string& why) {
    const auto found = peers_.find(worker);
    if (found == peers_.end() || std::exchange(found->second.closed, true)) return;
    ++refused_;
    std::fprintf(stderr, "worker: worker %u is heard no more on its link: %s\n", worker, why.c_str());
    miss(worker, found->second, found->second.step);
    beat(found->second);
}

bool PeerLinks::is_told(const WorkerMessage& message) const {
    if (settings_.pace == Pace::lockstep) return std::holds_alternative<PartMessage>(message);
    if (const auto* heard = std::get_if<HeardMessage>(&message)) return !heard->again;
    return std::holds_alternative<NeighbourMessage>(message) || std::holds_alternative<FoundMessage>(message);
}

void PeerLinks::read(std::uint32_t worker, Peer& peer, const zmq::message_t& message) {
    DecodedMessage m = decode_message({message.data<std::uint8_t>(), message.size()});
    const auto* beats = std::get_if<LinkBeat>(&m.message);
    if (m.header.worker != worker || (!beats && !is_told(m.message)))
        throw DecodeError("found what no worker tells another, expected a message of a step or a beat");
    if (beats) {
        peer.hears_this = beats->hears;
        if (peer.lost) miss(worker, peer, peer.step);  // of what somebody may be waiting for
        return;
    }
    const std::uint64_t step = m.header.step;
    if (step < peer.step || step > settings_.steps)
        throw DecodeError("found a message of step " + std::to_string(step) + ", expected one of " +
                          std::to_string(peer.step) + " to " + std::to_string(settings_.steps));
    if (std::exchange(peer.step, step) != step) peer.parts = 0;
    if (++peer.parts > 2 * settings_.most_parts) throw DecodeError("found more messages than a step needs");
    if (std::exchange(peer.lost, false)) miss(worker, peer, step);
    if (step >= peer.skip_until) heard_.push_back(std::move(m));
}

// Something of this step, the one before or the next one.
void PeerLinks::miss(std::uint32_t worker, Peer& peer, std::uint64_t step) {
    if (settings_.pace == Pace::bounded) return;
    for (const std::uint64_t after : {0, 1, 2})
        if (step + after > 0) heard_.push_back({{worker, 0, step + after - 1}, PartMessage{true, {}}});
    peer.skip_until = step + 2;
}

}  // namespace sim
