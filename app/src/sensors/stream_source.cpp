#include "sensors/stream_source.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "process/clock.h"

namespace app {
namespace {

constexpr std::size_t kPiece = 4096;

/// Milliseconds until then, rounded up.
int milliseconds_until(std::int64_t deadline_ns) {
    const std::int64_t left = deadline_ns - monotonic_ns();
    return left <= 0 ? 0 : static_cast<int>((left + 999'999) / 1'000'000);
}

}  // namespace

SourceHead head_of(const RowDecoder& rows, const LiveIntake& intake) {
    const tracking::Trace& keys = rows.keys();
    return {keys.rate_hz, keys.tip, keys.shaft, rows.oriented(), keys.source, intake.base_s()};
}

StreamSource::StreamSource(int descriptor, const SourceOptions& options)
    : descriptor_(descriptor),
      intake_(options.sticks),
      rows_(
          "stdin",
          [this](const tracking::TraceRow& row) { intake_.put(row.name, row.sample, true, read_ns_); },
          [this](const std::string& what) { intake_.malformed(what); }) {
    rows_.piece(options.stream_head);
    if (options.resume) rows_.skip_line();
}

SourceHead StreamSource::head() const {
    return head_of(rows_, intake_);
}

SourceStatus StreamSource::next(SourceSample& sample, std::int64_t deadline_ns) {
    std::optional<SourceSample> next = intake_.take();
    if (!next && !ended_) {
        read_on(deadline_ns);
        next = intake_.take();
    }
    if (!next) return ended_ ? SourceStatus::ended : SourceStatus::waiting;
    sample = *next;
    return SourceStatus::sample;
}

void StreamSource::read_on(std::int64_t deadline_ns) {
    pollfd watched{descriptor_, POLLIN, 0};
    if (poll(&watched, 1, milliseconds_until(deadline_ns)) <= 0) return;
    std::array<char, kPiece> piece;
    const ssize_t size = read(descriptor_, piece.data(), piece.size());
    read_ns_ = monotonic_ns();
    if (size > 0) {
        rows_.piece({piece.data(), static_cast<std::size_t>(size)});
    } else if (size == 0) {
        rows_.end();
        ended_ = true;
    } else if (errno != EINTR && errno != EAGAIN) {
        throw std::runtime_error(fmt::format(
            "error: found standard input unreadable ({}), expected rows of a trace", std::strerror(errno)));
    }
}

}  // namespace app
