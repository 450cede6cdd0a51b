// Datagrams of Open Sound Control.
#include <unistd.h>

#include <memory>
#include <stdexcept>

#include "fuzz_target.h"
#include "process/clock.h"
#include "sensors/live_sources.h"

namespace {

/// On a port of its own, of which it reads nothing.
std::unique_ptr<app::OscSource> make_source() {
    constexpr int kFirst = 20000, kPorts = 10000;
    for (int i = getpid() % kPorts;; ++i) {
        try {
            return std::make_unique<app::OscSource>(std::to_string(kFirst + i % kPorts),
                                                    app::SourceOptions{});
        } catch (const std::runtime_error&) {  // taken
        }
    }
}

}  // namespace

void fuzz_osc(std::string_view bytes) {
    static const std::unique_ptr<app::OscSource> source = make_source();
    source->datagram({bytes.data(), bytes.size()});
    for (app::SourceSample sample; source->next(sample, app::monotonic_ns()) == app::SourceStatus::sample;)
        require(sample.sample.position.allFinite(), "a position that is none");
}
