#pragma once
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "sensors/sample_source.h"

namespace app {

/// Samples on their way from the reader's thread to the filters': at most kLongest.
class SampleQueue {
public:
    static constexpr std::size_t kLongest = 256;

    /// Adds a sample; waits for room if there is none. False when told to stop meanwhile.
    bool push(const SourceSample& sample, const std::stop_token& stop);
    /// Adds a sample if there is room.
    [[nodiscard]] bool try_push(const SourceSample& sample);
    /// The next sample, waiting for it; none after close(), or when told to stop.
    [[nodiscard]] std::optional<SourceSample> pop(const std::stop_token& stop);
    /// There will be no more.
    void close();

private:
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<SourceSample> samples_;
    bool closed_ = false;
};

}  // namespace app
