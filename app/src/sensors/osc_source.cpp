#include "sensors/osc_source.h"

#include <fmt/format.h>
#include <lo/lo.h>
#include <lo/lo_lowlevel.h>
#include <poll.h>
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

struct OscPose {
    std::string_view stick;
    tracking::PoseSample sample;
    bool has_time = false;
};

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

bool is_immediate(const lo_timetag& tag) {
    return tag.sec == 0 && tag.frac <= 1;
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

OscPose decode(std::string_view path, std::string_view types, lo_arg** arguments, const lo_timetag& bundle) {
    OscPose pose;
    pose.stick = stick_of(path);
    if (types.size() != 3 && types.size() != 4 && types.size() != 7 && types.size() != 8)
        refuse(path, fmt::format("{} arguments", types.size()),
               "3 (px py pz) or 7 (.. qw qx qy qz), and perhaps a time before them");
    std::optional<double> time = time_of(path, types, arguments);
    if (time) {
        types.remove_prefix(1);
        ++arguments;
    } else if (!is_immediate(bundle)) {
        time = seconds_of(bundle);
    }
    pose.has_time = time.has_value();
    pose.sample.t_s = time.value_or(0);
    for (int axis = 0; axis < 3; ++axis)
        pose.sample.position[axis] =
            number_of(path, types[static_cast<std::size_t>(axis)], arguments[axis], kFarthest);
    pose.sample.has_orientation = types.size() == 7;
    if (pose.sample.has_orientation)
        pose.sample.orientation = orientation_of(path, types.substr(3), arguments + 3);
    return pose;
}

}  // namespace

struct OscSource::Server {
    LiveIntake intake;
    lo_server server = nullptr;
    std::int64_t read_ns = 0;

    Server(const std::string& port, const std::vector<std::string>& sticks) : intake(sticks) {
        server = lo_server_new_with_proto(port.c_str(), LO_UDP, &keep_number);
        if (!server) throw std::runtime_error("error: " + cannot("open UDP port " + port, error_number));
        lo_server_enable_queue(server, 0, 1);  // a bundle's time is when it was measured, not when it is due
        lo_server_add_method(server, nullptr, nullptr, &take, this);
    }
    ~Server() { lo_server_free(server); }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    static thread_local int error_number;  // of the operating system, for liblo's newest error
    static void keep_number(int number, const char*, const char*) { error_number = number; }

    void dispatch(std::vector<char> bytes) {  // liblo turns numbers around in place
        read_ns = monotonic_ns();
        if (lo_server_dispatch_data(server, bytes.data(), bytes.size()) < 0)
            intake.malformed(
                "osc: error: found a datagram that is none of OSC, expected a message or a bundle");
    }
    /// Takes one datagram if there is one.
    void receive(std::int64_t deadline_ns) {
        const std::int64_t left = std::max<std::int64_t>(0, deadline_ns - monotonic_ns());
        pollfd watched{lo_server_get_socket_fd(server), POLLIN, 0};
        if (poll(&watched, 1, static_cast<int>((left + 999'999) / 1'000'000)) <= 0) return;
        std::vector<char> bytes(kLargestDatagram);
        const ssize_t size = recv(watched.fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
        if (size <= 0) return;
        bytes.resize(static_cast<std::size_t>(size));
        dispatch(std::move(bytes));
    }
    static int take(const char* path, const char* types, lo_arg** arguments, int count, lo_message message,
                    void* own) {
        static_cast<Server*>(own)->take(path, {types, static_cast<std::size_t>(count)}, arguments,
                                        lo_message_get_timestamp(message));
        return 0;
    }
    void take(std::string_view path, std::string_view types, lo_arg** arguments, const lo_timetag& bundle) {
        try {
            const OscPose pose = decode(path, types, arguments, bundle);
            intake.put(pose.stick, pose.sample, pose.has_time, read_ns);
        } catch (const std::invalid_argument& wrong) {
            intake.malformed(wrong.what());
        }
    }
};

thread_local int OscSource::Server::error_number = 0;

void check_osc_port(const std::string& port) {
    unsigned number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (error != std::errc{} || end != port.data() + port.size() || number < 1 || number > 65535)
        throw BadInput(
            fmt::format("error: found source \"osc:{}\", expected a UDP port such as osc:9000", port));
}

OscSource::OscSource(const std::string& port, const SourceOptions& options) {
    check_osc_port(port);
    server_ = std::make_unique<Server>(port, options.sticks);
}

OscSource::~OscSource() = default;

SourceStatus OscSource::next(SourceSample& sample, std::int64_t deadline_ns) {
    std::optional<SourceSample> next = server_->intake.take();
    if (!next) {
        server_->receive(deadline_ns);
        next = server_->intake.take();
    }
    if (!next) return SourceStatus::waiting;
    sample = *next;
    return SourceStatus::sample;
}

void OscSource::datagram(std::span<const char> bytes) {
    server_->dispatch({bytes.begin(), bytes.end()});
}

const StickNames& OscSource::sticks() const {
    return server_->intake.sticks();
}

SourceHead OscSource::head() const {
    SourceHead head;
    head.base_s = server_->intake.base_s();
    return head;
}

SourceFaults OscSource::faults() const {
    return server_->intake.faults();
}

}  // namespace app
