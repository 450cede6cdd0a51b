#include "sensors/live_sources.h"

#include <fmt/format.h>
#include <lo/lo.h>
#include <lo/lo_lowlevel.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>
#include <zmq.hpp>

#include "files/bad_input.h"
#include "files/file_descriptor.h"
#include "process/clock.h"

namespace app {
namespace {

constexpr std::size_t kLongestHead = 2000;

class StreamSource final : public RowSource {
public:
    StreamSource(int descriptor, const SourceOptions& options)
        : RowSource("stdin", options), descriptor_(descriptor) {
        if (options.resume) rows_.skip_line();
    }

protected:
    void receive(std::int64_t deadline_ns) override {
        if (!readable_until(descriptor_, deadline_ns)) return;
        std::array<char, 4096> piece;
        const ssize_t size = read(descriptor_, piece.data(), piece.size());
        read_ns_ = monotonic_ns();
        if (size > 0) {
            rows_.piece({piece.data(), static_cast<std::size_t>(size)});
        } else if (size == 0) {
            rows_.end();
            ended_ = true;
        } else if (errno != EINTR && errno != EAGAIN) {
            throw std::runtime_error("error: " + cannot("read standard input"));
        }
    }

private:
    int descriptor_;
};

class ZmqSource final : public RowSource {
public:
    ZmqSource(const std::string& endpoint, const SourceOptions& options)
        : RowSource("zmq", options), socket_(context_, zmq::socket_type::sub) {
        constexpr std::int64_t kLargestMessage = 65536;  // bytes
        constexpr int kMostWaiting = 1000;               // messages in the socket's queue
        constexpr int kReconnectMs = 100;
        socket_.set(zmq::sockopt::linger, 0);
        socket_.set(zmq::sockopt::rcvhwm, kMostWaiting);
        socket_.set(zmq::sockopt::maxmsgsize, kLargestMessage);
        socket_.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
        socket_.set(zmq::sockopt::ipv6, true);
        socket_.set(zmq::sockopt::subscribe, "");
        try {
            if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://"))
                throw zmq::error_t(EINVAL);
            socket_.connect(endpoint);
        } catch (const zmq::error_t&) {
            throw BadInput(fmt::format(
                "error: found source \"zmq:{}\", expected an endpoint such as zmq:tcp://127.0.0.1:5556",
                endpoint));
        }
    }

protected:
    /// Takes one message if there is one.
    void receive(std::int64_t deadline_ns) override {
        try {
            zmq::pollitem_t watched{socket_.handle(), 0, ZMQ_POLLIN, 0};
            zmq::poll(&watched, 1, std::chrono::milliseconds(milliseconds_until(deadline_ns)));
            zmq::message_t part;
            if (!socket_.recv(part, zmq::recv_flags::dontwait)) return;
            read_ns_ = monotonic_ns();
            while (part.more())
                if (!socket_.recv(part, zmq::recv_flags::none)) return;  // all parts arrive together
            rows_.message(part.to_string_view());
        } catch (const zmq::error_t& wrong) {
            if (wrong.num() != EINTR)
                throw std::runtime_error(fmt::format("error: cannot receive from ZeroMQ: {}", wrong.what()));
        }
    }

private:
    zmq::context_t context_;
    zmq::socket_t socket_;
};

constexpr std::string_view kAddressPrefix = "/musicworld/stick/";
constexpr std::size_t kLargestDatagram = 65536;
constexpr double kFarthest = 1000;  // m
constexpr double kLatest = 1e11;    // s
constexpr double kNormTolerance = 0.01;
constexpr double kFractionsPerS = 4294967296.0;  // of a time tag

/// An argument's value. OSC aligns to 4 bytes, less than the union lo_arg wants.
template <class T>
T value_of(const lo_arg* argument) {
    T value;
    std::memcpy(&value, static_cast<const void*>(argument), sizeof value);
    return value;
}

double seconds_of(const lo_timetag& tag) {
    return tag.sec + tag.frac / kFractionsPerS;
}

[[noreturn]] void refuse(std::string_view path, const std::string& found, const std::string& expected) {
    throw std::invalid_argument(
        fmt::format("osc {}: error: found {}, expected {}", one_line(path, 60), found, expected));
}

std::string_view stick_of(std::string_view path) {
    std::string_view name = path;
    name.remove_prefix(name.starts_with(kAddressPrefix) ? kAddressPrefix.size()
                                                        : std::min<std::size_t>(1, name.size()));
    if (name.empty() || name.find('/') != std::string_view::npos)
        refuse(path, "this address", "/musicworld/stick/NAME or /NAME");
    return name;
}

double number_of(std::string_view path, char type, const lo_arg* argument, double limit) {
    if (type != 'f' && type != 'd')
        refuse(path, fmt::format("an argument of type {}", one_line({&type, 1})), "floats or doubles");
    const double number =
        type == 'f' ? static_cast<double>(value_of<float>(argument)) : value_of<double>(argument);
    if (!(std::abs(number) <= limit))
        refuse(path, fmt::format("{}", number), fmt::format("a number within {}", limit));
    return number;
}

Eigen::Quaterniond orientation_of(std::string_view path, std::string_view types, lo_arg** arguments) {
    double c[4];
    for (std::size_t i = 0; i < 4; ++i) c[i] = number_of(path, types[i], arguments[i], 1 + kNormTolerance);
    const Eigen::Quaterniond q(c[0], c[1], c[2], c[3]);
    if (!(std::abs(q.norm() - 1) <= kNormTolerance))
        refuse(path, fmt::format("a quaternion of norm {}", q.norm()), "qw qx qy qz of norm 1 within 1 %");
    return q.normalized();
}

/// The time argument, if there is one.
std::optional<double> time_of(std::string_view path, std::string_view types, lo_arg** arguments) {
    if (types.size() != 4 && types.size() != 8) return std::nullopt;
    if (types[0] == 't') return seconds_of(value_of<lo_timetag>(arguments[0]));
    if (types[0] == 'd') return number_of(path, 'd', arguments[0], kLatest);
    refuse(path,
           fmt::format("{} arguments, the first of type {}", types.size(), one_line(types.substr(0, 1))),
           "the first of 4 or 8 to be a time: a double or a time tag");
}

/// Adds what a message says to the source; `bundle`: the time tag that it came with.
void decode(std::string_view path, std::string_view types, lo_arg** arguments, const lo_timetag& bundle,
            OscSource& source) {
    const std::string_view stick = stick_of(path);
    if (types.size() != 3 && types.size() != 4 && types.size() != 7 && types.size() != 8)
        refuse(path, fmt::format("{} arguments", types.size()),
               "3 (px py pz) or 7 (.. qw qx qy qz), and perhaps a time before them");
    std::optional<double> time = time_of(path, types, arguments);
    if (time) {
        types.remove_prefix(1);
        ++arguments;
    } else if (bundle.sec != 0 || bundle.frac > 1) {  // not "at once"
        time = seconds_of(bundle);
    }
    tracking::PoseSample sample;
    sample.t_s = time.value_or(0);
    for (int axis = 0; axis < 3; ++axis)
        sample.position[axis] =
            number_of(path, types[static_cast<std::size_t>(axis)], arguments[axis], kFarthest);
    sample.has_orientation = types.size() == 7;
    if (sample.has_orientation) sample.orientation = orientation_of(path, types.substr(3), arguments + 3);
    source.put(stick, sample, time.has_value());
}

int take(const char* path, const char* types, lo_arg** arguments, int count, lo_message message,
         void* source) {
    auto& own = *static_cast<OscSource*>(source);
    try {
        decode(path, {types, static_cast<std::size_t>(count)}, arguments, lo_message_get_timestamp(message),
               own);
    } catch (const std::invalid_argument& wrong) {
        own.malformed(wrong.what());
    }
    return 0;
}

bool is_of_this_machine(const sockaddr_storage& sender) {
    if (sender.ss_family == AF_INET) {
        sockaddr_in v4{};
        std::memcpy(&v4, &sender, sizeof v4);
        return ntohl(v4.sin_addr.s_addr) >> 24 == 127;
    }
    sockaddr_in6 v6{};
    std::memcpy(&v6, &sender, sizeof v6);
    const std::uint8_t* bytes = v6.sin6_addr.s6_addr;
    return IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr) || (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr) && bytes[12] == 127);
}

thread_local int error_number = 0;  // of the operating system, for liblo's newest error
void keep_number(int number, const char*, const char*) {
    error_number = number;
}

}  // namespace

LiveSource::LiveSource(const std::vector<std::string>& sticks) : names_(sticks) {
    orientations_.fill(Eigen::Quaterniond::Identity());
}

SourceStatus LiveSource::next(SourceSample& sample, std::int64_t deadline_ns) {
    if (samples_.empty() && !ended_) receive(deadline_ns);
    if (samples_.empty()) return ended_ ? SourceStatus::ended : SourceStatus::waiting;
    sample = samples_.front();
    samples_.pop_front();
    return SourceStatus::sample;
}

SourceHead LiveSource::head() const {
    SourceHead head;
    head.base_s = base_s_.value_or(0);
    return head;
}

void LiveSource::put(std::string_view stick, tracking::PoseSample sample, bool has_time) {
    constexpr double kLongAgoS = 1e6;
    const std::optional<std::size_t> index = names_.index_of(stick);
    if (!index || samples_.size() == kLongest) {
        ++(index ? faults_.lost : faults_.foreign);
        return;
    }
    if (sample.has_orientation)
        orientations_[*index] = sample.orientation;
    else
        sample.orientation = orientations_[*index];
    if (has_time) {
        if (!base_s_) base_s_ = std::abs(sample.t_s) > kLongAgoS ? std::floor(sample.t_s) : 0;
        sample.t_s -= *base_s_;
    }
    samples_.push_back({*index, sample, has_time, 0, 0, read_ns_});
}

void LiveSource::malformed(const std::string& what) {
    if (faults_.malformed++ == 0) faults_.first = one_line(what, 240);
}

RowDecoder::RowDecoder(std::string name, Take take, Refuse refuse)
    : name_(std::move(name)),
      take_(std::move(take)),
      refuse_(std::move(refuse)),
      rows_(name_, tracking::RowOrder::live) {}

void RowDecoder::piece(std::string_view bytes) {
    for (std::size_t end = bytes.find('\n'); end != std::string_view::npos; end = bytes.find('\n')) {
        grow(bytes.substr(0, end));
        this->end();
        bytes.remove_prefix(end + 1);
    }
    grow(bytes);
}

void RowDecoder::grow(std::string_view bytes) {
    if (skipping_) return;
    if (partial_.size() + bytes.size() <= kLongestLine) {
        partial_.append(bytes);
        return;
    }
    refuse_(
        fmt::format("{}: error: found a line of more than {} bytes, expected a row", name_, kLongestLine));
    skip_line();
}

void RowDecoder::end() {
    std::string_view text = skipping_ ? std::string_view() : partial_;
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.find_first_not_of(" \t") != std::string_view::npos) try {
            take_line(text);
        } catch (const tracking::TraceError& wrong) {
            refuse_(wrong.what());
        }
    skipping_ = false;
    partial_.clear();
}

void RowDecoder::message(std::string_view text) {
    piece(text);
    end();
}

void RowDecoder::take_line(std::string_view text) {
    if (text.starts_with('#') || text.starts_with("t,")) {
        if (rows_.headed() || !given_head_) {
            rows_ = {name_, tracking::RowOrder::live};
            head_.clear();
        }
        given_head_ = true;
        (void)rows_.take(text);
        if (head_.size() + text.size() < kLongestHead) head_.append(text).append("\n");
        return;
    }
    if (!rows_.headed() && !given_head_) rows_.assume_header();
    const bool short_row = !given_head_ && std::count(text.begin(), text.end(), ',') == 4;
    if (const auto row = rows_.take(short_row ? std::string(text) + ",,,," : std::string(text))) take_(*row);
}

RowSource::RowSource(const std::string& name, const SourceOptions& options)
    : LiveSource(options.sticks),
      rows_(
          name, [this](const tracking::TraceRow& row) { put(row.name, row.sample, true); },
          [this](const std::string& what) { malformed(what); }) {
    rows_.piece(options.stream_head);
}

SourceHead RowSource::head() const {
    return {rows_.keys(), rows_.oriented(), LiveSource::head().base_s};
}

std::unique_ptr<SampleSource> make_stream_source(int descriptor, const SourceOptions& options) {
    return std::make_unique<StreamSource>(descriptor, options);
}

std::unique_ptr<SampleSource> make_zmq_source(const std::string& endpoint, const SourceOptions& options) {
    return std::make_unique<ZmqSource>(endpoint, options);
}

void check_osc_port(const std::string& port) {
    unsigned number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (error != std::errc{} || end != port.data() + port.size() || number < 1 || number > 65535)
        throw BadInput(
            fmt::format("error: found source \"osc:{}\", expected a UDP port such as osc:9000", port));
}

OscSource::OscSource(const std::string& port, const SourceOptions& options)
    : LiveSource(options.sticks), local_(options.local) {
    check_osc_port(port);
    server_ = lo_server_new_with_proto(port.c_str(), LO_UDP, &keep_number);
    if (!server_) throw std::runtime_error("error: " + cannot("open UDP port " + port, error_number));
    lo_server_enable_queue(server_, 0, 1);  // a bundle's time is when it was measured, not when it is due
    lo_server_add_method(server_, nullptr, nullptr, &take, this);
}

OscSource::~OscSource() {
    lo_server_free(server_);
}

void OscSource::receive(std::int64_t deadline_ns) {
    const int socket = lo_server_get_socket_fd(server_);
    if (!readable_until(socket, deadline_ns)) return;
    std::vector<char> bytes(kLargestDatagram);
    sockaddr_storage sender{};
    socklen_t length = sizeof sender;
    const ssize_t size = recvfrom(socket, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                  reinterpret_cast<sockaddr*>(&sender), &length);
    if (size <= 0) return;
    if (local_ && !is_of_this_machine(sender))
        malformed(
            "osc: error: found a datagram of another machine, expected those of this one; see --remote");
    else
        datagram({bytes.data(), static_cast<std::size_t>(size)});
}

void OscSource::datagram(std::span<const char> datagram) {
    read_ns_ = monotonic_ns();
    std::vector<char> bytes(datagram.begin(), datagram.end());  // liblo turns numbers around in place
    if (lo_server_dispatch_data(server_, bytes.data(), bytes.size()) < 0)
        malformed("osc: error: found a datagram that is none of OSC, expected a message or a bundle");
}

}  // namespace app
