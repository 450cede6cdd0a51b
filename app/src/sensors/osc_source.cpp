#include "sensors/osc_source.h"

#include <fmt/format.h>
#include <lo/lo.h>
#include <lo/lo_lowlevel.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "files/bad_input.h"
#include "files/file_descriptor.h"
#include "files/one_line.h"
#include "process/clock.h"

namespace app {
namespace {

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

thread_local int error_number = 0;  // of the operating system, for liblo's newest error
void keep_number(int number, const char*, const char*) {
    error_number = number;
}

}  // namespace

void check_osc_port(const std::string& port) {
    unsigned number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (error != std::errc{} || end != port.data() + port.size() || number < 1 || number > 65535)
        throw BadInput(
            fmt::format("error: found source \"osc:{}\", expected a UDP port such as osc:9000", port));
}

OscSource::OscSource(const std::string& port, const SourceOptions& options) : LiveSource(options.sticks) {
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
    const ssize_t size = recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size > 0) datagram({bytes.data(), static_cast<std::size_t>(size)});
}

void OscSource::datagram(std::span<const char> datagram) {
    read_ns_ = monotonic_ns();
    std::vector<char> bytes(datagram.begin(), datagram.end());  // liblo turns numbers around in place
    if (lo_server_dispatch_data(server_, bytes.data(), bytes.size()) < 0)
        malformed("osc: error: found a datagram that is none of OSC, expected a message or a bundle");
}

}  // namespace app
