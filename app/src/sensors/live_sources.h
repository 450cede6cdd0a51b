#pragma once
#include <tracking/trace_rows.h>

#include <array>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "files/file_descriptor.h"
#include "sensors/sample_source.h"

namespace app {

/// What live sources share: samples that have been decoded wait to be taken, at most kLongest (newer ones are
/// lost); the names of their sticks; what was wrong. Times that count from long ago (1970, 1900) are counted
/// from the whole second of the first one, so that doubles keep them to the nanosecond.
class LiveSource : public SampleSource {
public:
    static constexpr std::size_t kLongest = 4096;

    /// Empty `sticks`: as they come.
    explicit LiveSource(const std::vector<std::string>& sticks);

    [[nodiscard]] SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) final;
    [[nodiscard]] const StickNames& sticks() const final { return names_; }
    [[nodiscard]] SourceFaults faults() const final { return faults_; }
    [[nodiscard]] SourceHead head() const override;

    /// Adds a sample; one without orientation gets the stick's newest one.
    void put(std::string_view stick, tracking::PoseSample sample, bool has_time);
    /// `what`: one line, whatever bytes were sent.
    void malformed(const std::string& what);

protected:
    /// Adds what has come by `deadline_ns`, waiting for it at most until then.
    virtual void receive(std::int64_t deadline_ns) = 0;

    std::int64_t read_ns_ = 0;  // CLOCK_MONOTONIC at which the newest bytes were here
    bool ended_ = false;        // nothing more will come

private:
    StickNames names_;
    std::array<Eigen::Quaterniond, StickNames::kMostSticks> orientations_;
    std::deque<SourceSample> samples_;
    SourceFaults faults_;
    std::optional<double> base_s_;
};

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

/// Poses from Open Sound Control messages over UDP (liblo).
///
///   address     /musicworld/stick/NAME or /NAME
///   arguments   px py pz, or px py pz qw qx qy qz: floats or doubles, metres, y up, body to world
///               before them, if the source has a clock: its time as a double [s] or as a time tag
///
/// Without a time argument the time tag of the bundle counts, if it has one; else the time of arrival.
class OscSource final : public LiveSource {
public:
    /// `where`: PORT, on this machine's loopback alone; ADDRESS:PORT, that address of this machine, * for all of
    /// them. Throws BadInput for what is none of these, std::runtime_error for a port that is taken.
    OscSource(const std::string& where, const SourceOptions& options);

    /// Takes the bytes of a datagram as if they had arrived.
    void datagram(std::span<const char> bytes);

protected:
    void receive(std::int64_t deadline_ns) override;

private:
    std::vector<FileDescriptor> sockets_;
};

/// Throws BadInput unless it is PORT or ADDRESS:PORT.
void check_osc_port(const std::string& where);

}  // namespace app
