#pragma once

namespace sim_bench {

/// How many quantised body states a second reach a worker over tcp on this machine, with everything that
/// belongs to it: encoded by one worker, encrypted and authenticated (CURVE), checked and decoded by the
/// other.
struct ThroughputSettings {
    int bodies = 400;  ///< a message
    int modes = 12;
    double seconds = 2;
    bool keys = true;                 ///< CURVE
    bool through_application = true;  ///< worker, application, worker, as in a run; else in one hop
};
struct Throughput {
    double updates_per_s = 0;
    double bytes_per_update = 0;  ///< the message's length over its bodies
    double encode_ns = 0;         ///< an update, alone on a thread
    double decode_ns = 0;
    double cpu_ns_per_update = 0;  ///< of all threads of this process in the measured time
};
[[nodiscard]] Throughput measure_update_throughput(const ThroughputSettings& settings);

}  // namespace sim_bench
