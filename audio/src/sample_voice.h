#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "audio/performance.h"
#include "audio/samples.h"
#include "csound_engine.h"

namespace audio {

/// A voice's samples in Csound's tables, and how often each region was struck.
class SampleVoice {
public:
    /// Puts the waves into tables from `first_table` on.
    SampleVoice(CsoundEngine& engine, std::shared_ptr<const SampleSet> set, int first_table);

    /// One event of `instr sample`.
    struct Event {
        std::array<double, 3> fields{};  ///< table, frames, gain: p12 to p14
        double left = 0, right = 0;
    };
    /// The events that a note sounds; valid until the next call. Counts the stroke, allocates nothing.
    [[nodiscard]] const std::vector<Event>& strike(const Note& note);
    /// The fields of its first region, for warming up; counts nothing.
    [[nodiscard]] const std::array<double, 3>& first() const { return first_; }

private:
    [[nodiscard]] Event event(const SampleRegion& region, double gain) const;

    std::shared_ptr<const SampleSet> set_;  // of the kit, whose other voices may hold it, too
    int first_table_;
    std::vector<std::uint32_t> counts_;
    std::vector<Event> events_;
    std::array<double, 3> first_{};
};

}  // namespace audio
