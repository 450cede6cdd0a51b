#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sensors/sample_source.h"
#include "sensors/source_clock.h"

namespace app {

struct RecordOptions {
    SourceOptions source;
    std::filesystem::path out;
    double seconds = 0;  ///< from the first sample on; 0: until the source ends or a signal comes
};

/// One stick of a recording.
struct RecordedStick {
    std::string name;
    std::uint64_t samples = 0;
    double first_s = 0, last_s = 0;
    std::uint64_t gaps = 0;  ///< longer than 2.5 intervals and 20 ms
    double longest_gap_s = 0;
    ClockReport clock;
    double apart_s =
        0;  ///< its clock behind the first stick's where they are far apart: was added to its times
};

struct RecordResult {
    std::vector<RecordedStick> sticks;  ///< that have the two samples that a trace needs
    std::vector<std::string> alone;     ///< sticks with one sample, left out
    std::uint64_t late = 0;             ///< samples not newer than the one before, left out
    SourceFaults faults;
};

/// Writes what a source gives to a native trace, with the times that the source gave (from the whole second
/// of the first one, where they count from long ago; its clock's jumps taken out, so that times increase; a stick
/// whose clock is far from the first one's is put on that), or the times of arrival since the first sample where it gives none. Rows go to OUT.partial every 0.2 s, so a
/// crash loses at most that and leaves a trace up to the last complete line; at the end (the source's,
/// `seconds`, SIGINT or SIGTERM) it becomes OUT. The file says which clock its times are of, and names
/// neither files, hosts nor ports.
///
/// Throws BadInput for an OUT that cannot be; std::runtime_error when writing fails (what was written stays
/// in OUT.partial) or nothing came that makes a trace.
[[nodiscard]] RecordResult record(const RecordOptions& options);

}  // namespace app
