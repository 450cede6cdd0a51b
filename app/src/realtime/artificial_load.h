#pragma once
#include <atomic>
#include <string>
#include <thread>
#include <vector>

namespace app {

/// Artificial load injected into a run in real time, for tests: parts separated by commas.
///
///   load:N@A-B       N threads that compute without pause from second A to B
///   renderer:MS@A-B  every frame takes MS milliseconds longer
///   stall:MS@A       the sensors pause for MS milliseconds
///
/// -B may be left out (to the end).
struct ArtificialLoad {
    int load_threads = 0;
    double load_from_s = 0, load_to_s = 0;
    double slower_s = 0, slower_from_s = 0, slower_to_s = 0;
    double stall_s = 0, stall_at_s = -1;

    [[nodiscard]] double slower_at(double s) const {
        return s >= slower_from_s && s < slower_to_s ? slower_s : 0;
    }
};

/// Throws BadInput with what was found and expected.
[[nodiscard]] ArtificialLoad parse_disturbance(const std::string& text);

/// Threads of ordinary priority that compute during the time of the load. The destructor ends them.
class BusyThreads {
public:
    BusyThreads(const ArtificialLoad& disturbance, std::int64_t epoch_ns);
    ~BusyThreads();
    BusyThreads(const BusyThreads&) = delete;
    BusyThreads& operator=(const BusyThreads&) = delete;

private:
    std::atomic<bool> end_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace app
