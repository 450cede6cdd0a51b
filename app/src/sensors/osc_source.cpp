#include <arpa/inet.h>
#include <fmt/format.h>
#include <lo/lo.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "files/bad_input.h"
#include "process/clock.h"
#include "sensors/live_sources.h"

namespace app {
namespace {

constexpr std::string_view kAddressPrefix = "/musicworld/stick/";
constexpr std::size_t kLargestDatagram = 65536;
constexpr double kFarthest = 1000;  // m
constexpr double kLatest = 1e11;    // s
constexpr double kNormTolerance = 0.01;
constexpr int kDeepestBundle = 8;
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

/// Takes one message; `tag`: of the bundle around it. Throws std::invalid_argument.
void take_message(std::span<const char> bytes, const lo_timetag& tag, OscSource& source) {
    // liblo turns numbers around in a copy of its own.
    const std::unique_ptr<void, decltype(&lo_message_free)> message(
        lo_message_deserialise(const_cast<char*>(bytes.data()), bytes.size(), nullptr), &lo_message_free);
    if (!message)
        throw std::invalid_argument(
            "osc: error: found a datagram that is none of OSC, expected a message or a bundle");
    const std::string_view types = lo_message_get_types(message.get());
    decode(bytes.data(), types, lo_message_get_argv(message.get()), tag, source);
}

/// A number of a bundle, of four bytes, highest first.
std::uint32_t number_at(std::span<const char> bytes, std::size_t at) {
    std::uint32_t number = 0;
    std::memcpy(&number, bytes.subspan(at, sizeof number).data(), sizeof number);
    return ntohl(number);
}

/// Takes a message or a bundle; what cannot be read is counted.
void take_packet(std::span<const char> bytes, lo_timetag tag, int depth, OscSource& source) {
    constexpr std::string_view kBundle("#bundle", 8);  // with its end
    constexpr std::size_t kHead = 16;
    try {
        if (!std::string_view(bytes.data(), bytes.size()).starts_with(kBundle))
            return take_message(bytes, tag, source);
        if (bytes.size() < kHead || depth == kDeepestBundle)
            throw std::invalid_argument(
                fmt::format("osc: error: found a bundle of {} bytes within {} others, expected 16 bytes and "
                            "more, within fewer than {}",
                            bytes.size(), depth, kDeepestBundle));
        tag = {number_at(bytes, 8), number_at(bytes, 12)};
        for (bytes = bytes.subspan(kHead); !bytes.empty();) {
            const std::size_t size = bytes.size() < 4 ? bytes.size() : number_at(bytes, 0);
            if (bytes.size() < 4 || size > bytes.size() - 4)
                throw std::invalid_argument(fmt::format(
                    "osc: error: found a bundle's part of {} bytes with {} left, expected a whole one", size,
                    bytes.size()));
            take_packet(bytes.subspan(4, size), tag, depth + 1, source);
            bytes = bytes.subspan(4 + size);
        }
    } catch (const std::invalid_argument& wrong) {
        source.malformed(wrong.what());
    }
}

struct Endpoint {
    std::string address, port;
};

/// Address empty: loopback. Throws BadInput.
Endpoint endpoint_of(const std::string& where) {
    const std::size_t colon = where.rfind(':');
    Endpoint endpoint{colon == std::string::npos ? "" : where.substr(0, colon),
                      colon == std::string::npos ? where : where.substr(colon + 1)};
    unsigned number = 0;
    const char* last = endpoint.port.data() + endpoint.port.size();
    const auto [end, error] = std::from_chars(endpoint.port.data(), last, number);
    if (error != std::errc{} || end != last || number < 1 || number > 65535 || colon == 0)
        throw BadInput(
            fmt::format("error: found source \"osc:{}\", expected a UDP port such as osc:9000 (loopback "
                        "alone), or an address "
                        "of this machine and a port, such as osc:*:9000 (all of them)",
                        where));
    if (endpoint.address.starts_with('[') && endpoint.address.ends_with(']'))
        endpoint.address = endpoint.address.substr(1, endpoint.address.size() - 2);
    return endpoint;
}

/// A bound UDP socket; none if the system has no such address. Throws std::runtime_error.
FileDescriptor bound(const char* address, const std::string& port, bool needed) {
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_DGRAM;
    hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
    if (getaddrinfo(address, port.c_str(), &hints, &found) != 0)
        throw BadInput(fmt::format(
            "error: found source \"osc:{}:{}\", expected a numeric address of this machine, or * for all",
            address, port));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
    FileDescriptor bound(socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const int six_alone = std::string_view(address) == "::" ? 0 : 1;
    if (found->ai_family == AF_INET6 && bound)
        (void)setsockopt(bound.get(), IPPROTO_IPV6, IPV6_V6ONLY, &six_alone, sizeof six_alone);
    if (bound && bind(bound.get(), found->ai_addr, found->ai_addrlen) == 0) return bound;
    const bool absent = errno == EADDRNOTAVAIL || errno == EAFNOSUPPORT;
    if (needed || !absent) throw std::runtime_error("error: " + cannot("open UDP port " + port, errno));
    return FileDescriptor();
}

}  // namespace

void check_osc_port(const std::string& where) {
    (void)endpoint_of(where);
}

OscSource::OscSource(const std::string& where, const SourceOptions& options) : LiveSource(options.sticks) {
    const auto [address, port] = endpoint_of(where);
    if (address.empty()) {
        sockets_.push_back(bound("127.0.0.1", port, true));
        sockets_.push_back(bound("::1", port, false));
    } else if (address == "*") {
        sockets_.push_back(bound("::", port, false));  // IPv4, too
        if (!sockets_.back()) sockets_.back() = bound("0.0.0.0", port, true);
    } else {
        sockets_.push_back(bound(address.c_str(), port, true));
    }
    std::erase_if(sockets_, [](const FileDescriptor& socket) { return !socket; });
}

void OscSource::receive(std::int64_t deadline_ns) {
    std::array<pollfd, 2> watched{};
    for (std::size_t i = 0; i < sockets_.size(); ++i) watched[i] = {sockets_[i].get(), POLLIN, 0};
    if (poll(watched.data(), sockets_.size(), milliseconds_until(deadline_ns)) <= 0) return;
    std::vector<char> bytes(kLargestDatagram);
    for (const FileDescriptor& socket : sockets_) {
        const ssize_t size = recv(socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
        if (size > 0) datagram({bytes.data(), static_cast<std::size_t>(size)});
    }
}

void OscSource::datagram(std::span<const char> bytes) {
    read_ns_ = monotonic_ns();
    take_packet(bytes, lo_timetag{0, 1}, 0, *this);  // at once
}

}  // namespace app
