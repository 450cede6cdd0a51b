#pragma once
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace app {

/// Artificial load injected into a run in real time, for tests; as text: parts separated by commas.
///
///   load:N@A-B       N threads that compute without pause from second A to B
///   renderer:MS@A-B  every frame takes MS milliseconds longer
///   stall:MS@A       the sensors pause for MS milliseconds
///
/// Without -B: to the end of the run. At most one part of each kind counts, the last.
struct ArtificialLoad {
    struct Part {
        double amount = 0, from_s = 0, to_s = 0;
    };
    Part load;             ///< amount: threads
    Part renderer, stall;  ///< amounts [ms]
    std::string text;      ///< as typed, for the products

    /// What a frame that is begun at s takes longer [s].
    [[nodiscard]] double slower_at(double s) const {
        return s >= renderer.from_s && s < renderer.to_s ? renderer.amount / 1e3 : 0;
    }
};

/// Throws BadInput with what was found and expected.
[[nodiscard]] ArtificialLoad parse_artificial_load(const std::string& text);

/// Threads of ordinary priority that compute from the load's begin to its end. The destructor joins them.
class BusyThreads {
public:
    BusyThreads(const ArtificialLoad& load, std::int64_t epoch_ns);
    ~BusyThreads();
    BusyThreads(const BusyThreads&) = delete;
    BusyThreads& operator=(const BusyThreads&) = delete;

private:
    std::atomic<bool> end_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace app
