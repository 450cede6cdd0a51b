#pragma once
#include "sensors/live_intake.h"
#include "sensors/row_decoder.h"

namespace app {

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
