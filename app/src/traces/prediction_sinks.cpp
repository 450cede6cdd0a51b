#include <fmt/format.h>
#include <lo/lo.h>

#include <charconv>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <zmq.hpp>

#include "files/bad_input.h"
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

/// One bundle a sample.
class OscSink final : public PredictionSink {
public:
    OscSink(const std::string& host, const std::string& port)
        : address_(lo_address_new_with_proto(LO_UDP, host.c_str(), port.c_str()), lo_address_free) {}

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
                for (const double number : {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)})
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
        (void)lo_send_bundle(address_.get(), bundle.get());  // nobody need listen
    }

private:
    using Bundle = std::unique_ptr<std::remove_pointer_t<lo_bundle>, decltype(&lo_bundle_free_recursive)>;
    std::unique_ptr<std::remove_pointer_t<lo_address>, decltype(&lo_address_free)> address_;
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
                fmt::format_to(out, ",{},{},{},{},{},{}", c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2),
                               c(2, 2));
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
    const std::string host = colon == std::string::npos ? "127.0.0.1" : rest.substr(0, colon),
                      port = colon == std::string::npos ? rest : rest.substr(colon + 1);
    unsigned number = 0;
    const auto [end, failed] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (host.empty() || failed != std::errc{} || end != port.data() + port.size() || number < 1 ||
        number > 65535)
        refuse_destination(destination);
    return std::make_unique<OscSink>(host, port);
}

}  // namespace app
