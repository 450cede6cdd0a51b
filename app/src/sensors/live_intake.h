#pragma once
#include <array>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "sensors/sample_source.h"

namespace app {

/// What live sources share: samples that have been decoded and wait to be taken, at most kLongest (newer ones
/// are lost); the names of their sticks; what was wrong. Times that count from long ago (1970, 1900) are
/// counted from the whole second of the first one, so that doubles keep them to the nanosecond.
class LiveIntake {
public:
    static constexpr std::size_t kLongest = 4096;

    explicit LiveIntake(const std::vector<std::string>& sticks) : names_(sticks) {}

    /// A sample without orientation gets the stick's newest one.
    void put(std::string_view stick, tracking::PoseSample sample, bool has_time, std::int64_t read_ns);
    /// `what`: one line, whatever bytes were sent.
    void malformed(const std::string& what);
    [[nodiscard]] std::optional<SourceSample> take();

    [[nodiscard]] const StickNames& sticks() const { return names_; }
    [[nodiscard]] const SourceFaults& faults() const { return faults_; }
    [[nodiscard]] double base_s() const { return base_s_.value_or(0); }

private:
    StickNames names_;
    std::array<Eigen::Quaterniond, StickNames::kMostSticks> orientations_ = identities();
    std::deque<SourceSample> samples_;
    SourceFaults faults_;
    std::optional<double> base_s_;

    static std::array<Eigen::Quaterniond, StickNames::kMostSticks> identities();
};

}  // namespace app
