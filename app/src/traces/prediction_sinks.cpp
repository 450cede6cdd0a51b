#include <fmt/format.h>
#include <lo/lo.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <zmq.hpp>

#include "files/bad_input.h"
#include "files/file_descriptor.h"
#include "traces/live_predict.h"

namespace app {
namespace {

constexpr std::string_view kToOsc = "osc:", kToZmq = "zmq:";

[[noreturn]] void refuse_destination(const std::string& destination) {
    throw BadInput(
        fmt::format("error: found --send {}, expected osc:PORT, osc:HOST:PORT or an endpoint such as "
                    "zmq:tcp://127.0.0.1:5557",
                    destination));
}

/// One bundle a sample. The host's name is looked up once: a look-up may take longer than a sample lasts.
class OscSink final : public PredictionSink {
public:
    OscSink(const std::string& host, const std::string& port) {
        addrinfo wanted{}, *found = nullptr;
        wanted.ai_socktype = SOCK_DGRAM;
        int failed = 0;
        for (const int family : {AF_INET, AF_INET6}) {  // who listens for OSC often has IPv4 alone
            wanted.ai_family = family;
            failed = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found);
            if (failed == 0) break;
        }
        if (failed != 0)
            throw BadInput(fmt::format("error: found --send to {}, expected a host that can be found: {}",
                                       host, gai_strerror(failed)));
        const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, freeaddrinfo);
        address_.assign(reinterpret_cast<const char*>(found->ai_addr), found->ai_addrlen);
        socket_ = FileDescriptor(::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, found->ai_protocol));
        if (!socket_) throw std::runtime_error("error: " + cannot("open a socket to " + host));
    }

    void send(const Prediction& p) override {
        const Bundle bundle(lo_bundle_new(LO_TT_IMMEDIATE), lo_bundle_free_recursive);
        for (const PredictedPose& at : p.poses) {
            lo_message message = lo_message_new();
            lo_message_add_double(message, p.t_s);
            const Eigen::Vector3d& x = at.pose.position;
            const Eigen::Quaterniond& q = at.pose.orientation;
            for (const double number : {at.lead_s, x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z()})
                lo_message_add_float(message, static_cast<float>(number));
            if (at.covariance) {
                const Eigen::Matrix3d& c = at.covariance->position;
                for (const double number : {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2),
                                            at.covariance->radius_50, at.covariance->radius_95})
                    lo_message_add_float(message, static_cast<float>(number));
            }
            lo_bundle_add_message(bundle.get(), ("/musicworld/predicted/" + p.stick).c_str(), message);
        }
        if (p.strike) {
            lo_message message = lo_message_new();
            lo_message_add_double(message, p.t_s);
            lo_message_add_float(message, static_cast<float>(p.strike->in_s));
            lo_message_add_float(message, static_cast<float>(p.strike->probability));
            lo_message_add_string(message, p.strike->instrument.c_str());
            lo_bundle_add_message(bundle.get(), ("/musicworld/next_strike/" + p.stick).c_str(), message);
        }
        std::size_t size = 0;
        const std::unique_ptr<void, decltype(&std::free)> bytes(
            lo_bundle_serialise(bundle.get(), nullptr, &size), std::free);
        // Nobody need listen: this socket is not connected, and so is not told.
        ssize_t sent = -1;
        do
            sent = ::sendto(socket_.get(), bytes.get(), size, MSG_DONTWAIT | MSG_NOSIGNAL,
                            reinterpret_cast<const sockaddr*>(address_.data()),
                            static_cast<socklen_t>(address_.size()));
        while (sent < 0 && errno == EINTR);
        if (sent < 0) ++unsent_;
    }
    [[nodiscard]] std::uint64_t unsent() const override { return unsent_; }

private:
    using Bundle = std::unique_ptr<std::remove_pointer_t<lo_bundle>, decltype(&lo_bundle_free_recursive)>;
    FileDescriptor socket_;
    std::string address_;  // a sockaddr
    std::uint64_t unsent_ = 0;
};

/// One message a sample: a row for each lead, and one for the strike.
class ZmqSink final : public PredictionSink {
public:
    explicit ZmqSink(const std::string& endpoint) : socket_(context_, zmq::socket_type::pub) {
        constexpr int kMostWaiting = 1000;
        socket_.set(zmq::sockopt::linger, 100);
        socket_.set(zmq::sockopt::sndhwm, kMostWaiting);
        socket_.set(zmq::sockopt::ipv6, true);
        try {
            socket_.bind(endpoint);
        } catch (const zmq::error_t& wrong) {
            if (wrong.num() == EADDRINUSE)
                throw std::runtime_error(
                    fmt::format("error: found {} in use, expected a free endpoint", endpoint));
            refuse_destination("zmq:" + endpoint);
        }
    }

    void send(const Prediction& p) override {
        text_.clear();
        const auto out = std::back_inserter(text_);
        for (const PredictedPose& at : p.poses) {
            const Eigen::Vector3d& x = at.pose.position;
            const Eigen::Quaterniond& q = at.pose.orientation;
            fmt::format_to(out, "predicted,{},{},{},{},{},{},{},{},{},{}", p.t_s, p.stick, at.lead_s, x.x(),
                           x.y(), x.z(), q.w(), q.x(), q.y(), q.z());
            if (at.covariance) {
                const Eigen::Matrix3d& c = at.covariance->position;
                fmt::format_to(out, ",{},{},{},{},{},{},{},{}", c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2),
                               c(2, 2), at.covariance->radius_50, at.covariance->radius_95);
            }
            text_ += '\n';
        }
        if (p.strike)
            fmt::format_to(out, "next_strike,{},{},{},{},{}\n", p.t_s, p.stick, p.strike->in_s,
                           p.strike->probability, p.strike->instrument);
        (void)socket_.send(zmq::const_buffer(text_.data(), text_.size()), zmq::send_flags::dontwait);
    }

private:
    zmq::context_t context_;
    zmq::socket_t socket_;
    std::string text_;
};

}  // namespace

std::unique_ptr<PredictionSink> open_prediction_sink(const std::string& destination) {
    if (destination.starts_with(kToZmq)) return std::make_unique<ZmqSink>(destination.substr(kToZmq.size()));
    if (!destination.starts_with(kToOsc)) refuse_destination(destination);
    const std::string rest = destination.substr(kToOsc.size());
    const std::size_t colon = rest.rfind(':');
    std::string host = colon == std::string::npos ? "127.0.0.1" : rest.substr(0, colon);
    if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
    const std::string port = colon == std::string::npos ? rest : rest.substr(colon + 1);
    unsigned number = 0;
    const auto [end, failed] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (host.empty() || failed != std::errc{} || end != port.data() + port.size() || number < 1 ||
        number > 65535)
        refuse_destination(destination);
    return std::make_unique<OscSink>(host, port);
}

}  // namespace app
