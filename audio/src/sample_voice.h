#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "audio/performance.h"
#include "audio/samples.h"
#include "csound_engine.h"

namespace audio {

/// Csound's tables of the waves of all voices: one for each wave.
class SampleTables {
public:
    explicit SampleTables(int first) : next_(first) {}
    /// The number of the wave's table, which is made if it is new.
    [[nodiscard]] int number(CsoundEngine& engine, const std::vector<float>& wave);

private:
    int next_;
    std::map<const std::vector<float>*, int> numbers_;
};

/// A voice's samples in Csound's tables, and how often each region was struck.
class SampleVoice {
public:
    SampleVoice(CsoundEngine& engine, std::shared_ptr<const SampleSet> set, SampleTables& tables);

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
    std::vector<int> tables_;               // by wave
    std::vector<std::uint32_t> counts_;
    std::vector<Event> events_;
    std::array<double, 3> first_{};
};

}  // namespace audio
