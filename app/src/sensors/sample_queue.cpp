#include "sensors/sample_queue.h"

namespace app {

bool SampleQueue::push(const SourceSample& sample, const std::stop_token& stop) {
    {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return samples_.size() < kLongest; })) return false;
        samples_.push_back(sample);
    }
    changed_.notify_all();
    return true;
}

bool SampleQueue::try_push(const SourceSample& sample) {
    {
        const std::lock_guard lock(mutex_);
        if (samples_.size() >= kLongest) return false;
        samples_.push_back(sample);
    }
    changed_.notify_all();
    return true;
}

std::optional<SourceSample> SampleQueue::pop(const std::stop_token& stop) {
    std::optional<SourceSample> sample;
    {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return !samples_.empty() || closed_; })) return sample;
        if (samples_.empty()) return sample;
        sample = samples_.front();
        samples_.pop_front();
    }
    changed_.notify_all();
    return sample;
}

void SampleQueue::close() {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
    }
    changed_.notify_all();
}

}  // namespace app
