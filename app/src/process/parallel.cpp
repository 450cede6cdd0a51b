#include "process/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace app {
namespace {

/// The indices still to be done, and the first exception.
class Work {
public:
    Work(std::size_t count, const std::function<void(std::size_t)>& work) : count_(count), work_(work) {}

    /// Does the next index; false when there is none.
    bool step() {
        const std::size_t index = next_.fetch_add(1);
        if (index >= count_) return false;
        try {
            work_(index);
        } catch (...) {
            const std::scoped_lock lock(mutex_);
            if (!failure_) failure_ = std::current_exception();
            next_ = count_;
        }
        return true;
    }

    [[nodiscard]] double share() const {
        return static_cast<double>(std::min(next_.load(), count_)) / static_cast<double>(count_);
    }
    void rethrow() const {
        if (failure_) std::rethrow_exception(failure_);
    }

private:
    std::size_t count_;
    const std::function<void(std::size_t)>& work_;
    std::atomic<std::size_t> next_ = 0;
    std::mutex mutex_;
    std::exception_ptr failure_;
};

}  // namespace

void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                  const std::function<void(double)>& done) {
    if (count == 0) return;
    Work queue(count, work);
    {
        std::vector<std::jthread> others;
        for (unsigned i = 1; i < threads && i < count; ++i)
            others.emplace_back([&queue] {
                while (queue.step()) {
                }
            });
        while (queue.step())
            if (done) done(queue.share());
    }
    queue.rethrow();
}

unsigned worthwhile_threads() {
    constexpr unsigned kMost = 8;
    return std::clamp(std::thread::hardware_concurrency(), 1U, kMost);
}

}  // namespace app
