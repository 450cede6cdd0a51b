// C3D files. The first byte says whether each point is a stick, or two and three markers are.
#include <cmath>

#include "fuzz_target.h"
#include "tracking/import.h"

namespace {

tracking::ColumnMap markers_of(unsigned char kind) {
    tracking::ColumnMap map;
    if (kind % 3 > 0) map.columns = {{"left.marker", "A"}, {"left.marker2", "B"}};
    if (kind % 3 > 1) map.columns.emplace("left.marker3", "C*");
    return map;
}

}  // namespace

void fuzz_c3d(std::string_view bytes) {
    if (bytes.empty() || !tracking::is_c3d(bytes.substr(1))) return;
    try {
        const tracking::Trace trace =
            tracking::read_markers(bytes.substr(1), "fuzz", markers_of(static_cast<unsigned char>(bytes[0])));
        require(!trace.sticks.empty(), "a trace without sticks");
        for (const tracking::StickTrace& stick : trace.sticks)
            for (const tracking::PoseSample& sample : stick.samples)
                require(sample.position.allFinite() && std::abs(sample.orientation.norm() - 1) < 1e-9,
                        "a pose that is none");
        (void)tracking::format_trace(trace);
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "fuzz:");
    }
}
