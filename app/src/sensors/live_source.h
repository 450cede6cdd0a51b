#pragma once
#include <array>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

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

}  // namespace app
