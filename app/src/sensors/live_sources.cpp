#include "sensors/live_sources.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
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

}  // namespace app
