// Extended Reality Open Recordings: BSON, in it tables that a child process decompresses.
#include <cmath>

#include "fuzz_target.h"
#include "tracking/trace.h"

void fuzz_xror(std::string_view bytes) {
    if (bytes.size() < 5 || bytes[4] == 't' || bytes[4] == '#') return;  // a native trace, perhaps
    try {
        const tracking::Trace trace = tracking::parse_trace(bytes, "fuzz");
        for (const tracking::StickTrace& stick : trace.sticks)
            for (const tracking::PoseSample& sample : stick.samples)
                require(sample.position.allFinite() && std::abs(sample.orientation.norm() - 1) < 1e-9,
                        "a pose that is none");
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "fuzz:");
    }
}
