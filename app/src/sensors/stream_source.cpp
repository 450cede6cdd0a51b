#include "sensors/stream_source.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>

#include "files/file_descriptor.h"
#include "process/clock.h"

namespace app {
namespace {

constexpr std::size_t kPiece = 4096;
constexpr std::size_t kLongestHead = 2000;
constexpr const char* kDefaultHeader = "t,stick,px,py,pz,qw,qx,qy,qz";

bool belongs_to_head(std::string_view line) {
    return line.starts_with('#') || line.starts_with("t,");
}

tracking::TraceRows new_rows(const std::string& name) {
    return {name, tracking::RowOrder::live};
}

/// Milliseconds until then, rounded up.
int milliseconds_until(std::int64_t deadline_ns) {
    const std::int64_t left = deadline_ns - monotonic_ns();
    return left <= 0 ? 0 : static_cast<int>((left + 999'999) / 1'000'000);
}

}  // namespace

RowDecoder::RowDecoder(std::string name, Take take, Refuse refuse)
    : name_(std::move(name)), take_(std::move(take)), refuse_(std::move(refuse)), rows_(new_rows(name_)) {}

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
    if (!skipping_) line(partial_);
    skipping_ = false;
    partial_.clear();
}

void RowDecoder::message(std::string_view text) {
    piece(text);
    end();
}

void RowDecoder::line(std::string_view text) {
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.find_first_not_of(" \t") == std::string_view::npos) return;
    try {
        take_line(text);
    } catch (const tracking::TraceError& wrong) {
        refuse_(wrong.what());
    }
}

void RowDecoder::take_line(std::string_view text) {
    if (belongs_to_head(text)) {
        if (rows_.headed() || !given_head_) {
            rows_ = new_rows(name_);
            head_.clear();
        }
        given_head_ = true;
        (void)rows_.take(text);
        if (head_.size() + text.size() < kLongestHead) head_.append(text).append("\n");
        return;
    }
    if (!rows_.headed() && !given_head_) (void)rows_.take(kDefaultHeader);
    const bool short_row = !given_head_ && std::count(text.begin(), text.end(), ',') == 4;
    if (const auto row = rows_.take(short_row ? std::string(text) + ",,,," : std::string(text))) take_(*row);
}

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
        throw std::runtime_error("error: " + cannot("read standard input"));
    }
}

}  // namespace app
