#pragma once
#include "process/clock.h"

namespace app {

/// Seconds of wall time that `work()` takes.
template <class Work>
[[nodiscard]] double seconds_of(const Work& work) {
    const WallTimer timer;
    work();
    return timer.seconds();
}

/// Adds the seconds of wall time of its life to a sum.
class Stopwatch {
public:
    explicit Stopwatch(double& sum_s) : sum_s_(sum_s) {}
    ~Stopwatch() { sum_s_ += timer_.seconds(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& sum_s_;
    WallTimer timer_;
};

}  // namespace app
