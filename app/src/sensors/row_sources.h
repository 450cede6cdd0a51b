#pragma once
#include <tracking/trace_rows.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "sensors/sample_source.h"

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
    void take_line(std::string_view text);

    std::string name_;
    Take take_;
    Refuse refuse_;
    tracking::TraceRows rows_;
    bool given_head_ = false;  // rows_ has key lines or a header that were sent
    std::string head_, partial_;
    bool skipping_ = false;
};

/// A live source of native rows. The units, axes, tip and shaft of their key lines are honoured.
class RowSource : public LiveSource {
public:
    [[nodiscard]] SourceHead head() const override;
    [[nodiscard]] std::string stream_head() const override { return rows_.head(); }

protected:
    RowSource(const std::string& name, const SourceOptions& options);

    RowDecoder rows_;
};

/// Rows from a descriptor (standard input), as they come; it ends with the stream.
[[nodiscard]] std::unique_ptr<SampleSource> make_stream_source(int descriptor, const SourceOptions& options);

/// Rows from a ZeroMQ publisher: a SUB socket that connects and subscribes to everything. The last part of
/// each message is one row or several, with or without a head (RowDecoder); messages of more than 64 KiB are
/// refused by the socket. It never ends; a publisher that comes later or again is found. Throws BadInput for
/// what is no endpoint.
[[nodiscard]] std::unique_ptr<SampleSource> make_zmq_source(const std::string& endpoint,
                                                            const SourceOptions& options);

}  // namespace app
