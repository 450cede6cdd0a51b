#include "sensors/zmq_source.h"

#include <fmt/format.h>

#include <zmq.hpp>

#include "files/bad_input.h"
#include "process/clock.h"
#include "sensors/stream_source.h"

namespace app {
namespace {

constexpr std::int64_t kLargestMessage = 65536;  // bytes
constexpr int kMostWaiting = 1000;               // messages in the socket's queue
constexpr int kReconnectMs = 100;

}  // namespace

struct ZmqSource::Connection {
    LiveIntake intake;
    RowDecoder rows;
    zmq::context_t context;
    zmq::socket_t socket;
    std::int64_t read_ns = 0;

    explicit Connection(const std::vector<std::string>& sticks)
        : intake(sticks),
          rows(
              "zmq",
              [this](const tracking::TraceRow& row) { intake.put(row.name, row.sample, true, read_ns); },
              [this](const std::string& what) { intake.malformed(what); }),
          socket(context, zmq::socket_type::sub) {
        socket.set(zmq::sockopt::linger, 0);
        socket.set(zmq::sockopt::rcvhwm, kMostWaiting);
        socket.set(zmq::sockopt::maxmsgsize, kLargestMessage);
        socket.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
        socket.set(zmq::sockopt::ipv6, true);
        socket.set(zmq::sockopt::subscribe, "");
    }

    void wait(std::int64_t deadline_ns) {
        const std::int64_t left = std::max<std::int64_t>(0, deadline_ns - monotonic_ns());
        zmq::pollitem_t watched{socket.handle(), 0, ZMQ_POLLIN, 0};
        zmq::poll(&watched, 1, std::chrono::milliseconds((left + 999'999) / 1'000'000));
    }

    /// Takes one message if there is one.
    void receive() {
        zmq::message_t part;
        if (!socket.recv(part, zmq::recv_flags::dontwait)) return;
        read_ns = monotonic_ns();
        while (part.more())
            if (!socket.recv(part, zmq::recv_flags::none)) return;  // all parts arrive together
        rows.message(part.to_string_view());
    }
};

ZmqSource::ZmqSource(const std::string& endpoint, const SourceOptions& options)
    : connection_(std::make_unique<Connection>(options.sticks)) {
    connection_->rows.piece(options.stream_head);
    try {
        if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://")) throw zmq::error_t(EINVAL);
        connection_->socket.connect(endpoint);
    } catch (const zmq::error_t&) {
        throw BadInput(fmt::format(
            "error: found source \"zmq:{}\", expected an endpoint such as zmq:tcp://127.0.0.1:5556",
            endpoint));
    }
}

ZmqSource::~ZmqSource() = default;

SourceStatus ZmqSource::next(SourceSample& sample, std::int64_t deadline_ns) {
    std::optional<SourceSample> next = connection_->intake.take();
    if (!next) try {
            connection_->wait(deadline_ns);
            connection_->receive();
            next = connection_->intake.take();
        } catch (const zmq::error_t& wrong) {
            if (wrong.num() != EINTR)
                throw std::runtime_error(fmt::format("error: cannot receive from ZeroMQ: {}", wrong.what()));
        }
    if (!next) return SourceStatus::waiting;
    sample = *next;
    return SourceStatus::sample;
}

const StickNames& ZmqSource::sticks() const {
    return connection_->intake.sticks();
}

SourceHead ZmqSource::head() const {
    return head_of(connection_->rows, connection_->intake);
}

SourceFaults ZmqSource::faults() const {
    return connection_->intake.faults();
}

std::string ZmqSource::stream_head() const {
    return connection_->rows.head();
}

}  // namespace app
