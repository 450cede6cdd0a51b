#pragma once
#include <tracking/trace.h>

#include "sensors/sample_source.h"

namespace app {

/// A trace replayed at its own times: sample i of lap k is due at
///
///   epoch + (k period + t_i - t0) / speed,   t0 the earliest time of all sticks of the trace
///
/// Every sample of the sticks asked for comes, in order of time, those of one time in order of the sticks.
class TraceSource final : public SampleSource {
public:
    /// `file`: a path, or the name of a bundled trace. Throws BadInput, tracking::TraceError.
    TraceSource(const std::string& file, const SourceOptions& options);

    [[nodiscard]] SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) override;
    [[nodiscard]] const StickNames& sticks() const override { return names_; }
    [[nodiscard]] SourceHead head() const override { return head_; }
    [[nodiscard]] bool replayed() const override { return true; }
    [[nodiscard]] std::int64_t quiet_until_ns() const override;
    [[nodiscard]] std::uint64_t passed_over(std::size_t stick, std::uint64_t lap,
                                            std::optional<double> t_s) const override;

private:
    struct Row {
        std::size_t stick;
        tracking::PoseSample sample;
    };
    [[nodiscard]] std::int64_t due_ns(const Row& row) const;
    void pass_on();
    void skip_until(std::int64_t now_ns);

    SourceOptions options_;
    SourceHead head_;
    StickNames names_;
    std::vector<Row> rows_;
    double t0_s_ = 0;
    std::size_t next_ = 0;
    std::uint64_t lap_ = 0;
};

}  // namespace app
