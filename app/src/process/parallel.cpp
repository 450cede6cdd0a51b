#include "process/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace app {

void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                  const std::function<void(double)>& done) {
    std::atomic<std::size_t> next = 0;  // index to be done
    std::mutex mutex;
    std::exception_ptr failure;
    const auto work_on = [&](const std::function<void(double)>& report) {
        for (std::size_t index = 0; (index = next.fetch_add(1)) < count;) {
            try {
                work(index);
            } catch (...) {
                const std::scoped_lock lock(mutex);
                if (!failure) failure = std::current_exception();
                next = count;
            }
            if (report) report(double(std::min(next.load(), count)) / double(count));
        }
    };
    {
        std::vector<std::jthread> others;
        for (unsigned i = 1; i < threads && i < count; ++i) others.emplace_back(work_on, nullptr);
        work_on(done);
    }
    if (failure) std::rethrow_exception(failure);
}

unsigned worthwhile_threads() {
    constexpr unsigned kMost = 8;
    return std::clamp(std::thread::hardware_concurrency(), 1U, kMost);
}

}  // namespace app
