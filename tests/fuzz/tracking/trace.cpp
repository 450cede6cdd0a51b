// Traces: the native CSV, and Beat Saber Open Replays, which begin with another word.
#include "tracking/trace.h"

#include <cmath>

#include "fuzz_target.h"

void fuzz_trace(std::string_view bytes) {
    try {
        const tracking::Trace trace = tracking::parse_trace(bytes, "fuzz");
        require(!trace.sticks.empty(), "a trace without sticks");
        for (const tracking::StickTrace& stick : trace.sticks) {
            require(stick.samples.size() >= 2, "a stick of one sample");
            for (std::size_t i = 0; i < stick.samples.size(); ++i) {
                const tracking::PoseSample& sample = stick.samples[i];
                require(sample.position.allFinite() && std::abs(sample.orientation.norm() - 1) < 1e-9,
                        "a pose that is none");
                require(i == 0 || sample.t_s > stick.samples[i - 1].t_s, "times that do not increase");
            }
        }
        const std::string written = tracking::format_trace(trace);
        require(tracking::format_trace(tracking::parse_trace(written, "again")) == written,
                "a trace that reads back to another");
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "fuzz:");
    }
}
