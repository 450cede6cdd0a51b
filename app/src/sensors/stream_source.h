#pragma once
#include <tracking/trace_rows.h>

#include <functional>
#include <string>
#include <string_view>

#include "sensors/live_intake.h"

namespace app {

/// Rows of the native format as they come: `# key: value` lines and a header may stand before them, and
/// again later (they hold until the next ones); without any, rows are t,stick,px,py,pz[,qw,qx,qy,qz] in m, y
/// up. Bounded: lines of at most kLongestLine bytes.
class RowDecoder {
public:
    static constexpr std::size_t kLongestLine = 4096;
    using Take = std::function<void(const tracking::TraceRow&)>;
    using Refuse = std::function<void(const std::string&)>;  ///< one line that says what is wrong with a row

    /// `name` stands for the source in messages.
    RowDecoder(std::string name, Take take, Refuse refuse);

    /// A piece of a stream, however it is cut.
    void piece(std::string_view bytes);
    /// What has come since the last line end is a line, too.
    void end();
    /// One whole message: its last line needs no end.
    void message(std::string_view text);
    /// Leave out what comes before the next line end: the stream is taken up in the middle.
    void skip_line() {
        skipping_ = true;
        partial_.clear();
    }

    /// Of the key lines; nothing before the header.
    [[nodiscard]] const tracking::Trace& keys() const { return rows_.keys(); }
    [[nodiscard]] bool oriented() const { return !rows_.headed() || rows_.oriented(); }
    /// The key lines and header in force, at most 2000 bytes; empty if none were sent, or the header line has
    /// not come yet.
    [[nodiscard]] std::string head() const { return rows_.headed() ? head_ : std::string(); }

private:
    void grow(std::string_view bytes);
    void line(std::string_view text);
    void take_line(std::string_view text);

    std::string name_;
    Take take_;
    Refuse refuse_;
    tracking::TraceRows rows_;
    bool given_head_ = false;  // rows_ has key lines or a header that were sent
    std::string head_, partial_;
    bool skipping_ = false;
};

/// Native rows from a descriptor (standard input), as they come; it ends with the stream. The units, axes,
/// tip and shaft of its key lines are honoured.
class StreamSource final : public SampleSource {
public:
    StreamSource(int descriptor, const SourceOptions& options);

    [[nodiscard]] SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) override;
    [[nodiscard]] const StickNames& sticks() const override { return intake_.sticks(); }
    [[nodiscard]] SourceHead head() const override;
    [[nodiscard]] SourceFaults faults() const override { return intake_.faults(); }
    [[nodiscard]] std::string stream_head() const override { return rows_.head(); }

private:
    /// Reads what is there; waits until then.
    void read_on(std::int64_t deadline_ns);

    int descriptor_;
    LiveIntake intake_;
    RowDecoder rows_;
    std::int64_t read_ns_ = 0;
    bool ended_ = false;
};

/// How the rows' keys describe a live source.
[[nodiscard]] SourceHead head_of(const RowDecoder& rows, const LiveIntake& intake);

}  // namespace app
