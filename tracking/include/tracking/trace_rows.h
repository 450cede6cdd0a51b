#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tracking/trace.h"

namespace tracking {

/// One row of the native format.
struct TraceRow {
    std::size_t stick = 0;  ///< in order of first appearance
    std::string_view name;  ///< of the stick; valid until the next line
    PoseSample sample;
};

/// A file must be in order; what comes live may be late or repeated, and its times may count from long ago
/// (|t| <= 1e11 s). A live stream has at most kMostLiveSticks sticks.
enum class RowOrder { strict, live };
inline constexpr std::size_t kMostLiveSticks = 16;

/// Reads the native format (read_trace says what that is) a line at a time: `# key: value` lines, the header,
/// rows. A faulty line throws TraceError with its place and changes nothing but the line count, so the
/// next may be read. Memory is bounded by the number of sticks. One thread.
class TraceRows {
public:
    /// `name` stands for the file in messages.
    TraceRows(const std::string& name, RowOrder order);
    ~TraceRows();
    TraceRows(TraceRows&& other) noexcept;
    TraceRows& operator=(TraceRows&& other) noexcept;

    /// Takes the next line, without its end; a row if it was one. Before the header blank lines are skipped.
    [[nodiscard]] std::optional<TraceRow> take(std::string_view line);
    /// As if the header t,stick,px,py,pz,qw,qx,qy,qz had been read, without counting a line.
    void assume_header();
    /// The header has been read: rows follow.
    [[nodiscard]] bool headed() const noexcept;
    /// Rows have columns of an orientation.
    [[nodiscard]] bool oriented() const noexcept;
    /// Rate, source, tip and shaft, once headed.
    [[nodiscard]] const Trace& keys() const noexcept;
    /// Throws TraceError unless there were a header and at least two samples of each stick.
    void require_complete() const;

private:
    struct Reading;
    std::unique_ptr<Reading> reading_;
};

/// The key lines and the header of a native trace in metres and y up: rate, source, tip and shaft of `keys`.
/// Throws std::invalid_argument as format_trace().
[[nodiscard]] std::string format_trace_head(const Trace& keys, bool oriented);
/// Appends a row. Throws std::invalid_argument for a stick name that is not a word.
void append_trace_row(std::string& text, const std::string& stick, const PoseSample& sample, bool oriented);

}  // namespace tracking
