#include "contact/crew.h"

#include <pmmintrin.h>

#include <system_error>

namespace sim {
namespace {

constexpr int kAwake = 1000, kLetting = 200;  // rounds: some 20 us awake, then so often others may run

}  // namespace

FlushDenormals::FlushDenormals() : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | 0x8040);
}

FlushDenormals::~FlushDenormals() {
    _mm_setcsr(before_);
}

bool ShortWait::again() noexcept {
    rounds_ = std::min(rounds_ + 1, kAwake + kLetting);
    if (rounds_ < kAwake) {
        _mm_pause();
    } else {
        std::this_thread::yield();
    }
    return rounds_ < kAwake + kLetting;
}

Crew::Crew(int threads) {
    helpers_.reserve(static_cast<std::size_t>(std::max(0, threads - 1)));
    try {
        for (int i = 1; i < threads; ++i) helpers_.emplace_back([this, i] { help(i); });
    } catch (const std::system_error&) {
        // The system gives no more: results do not depend on how many there are.
    }
}

Crew::~Crew() {
    over_ = true;
    gate_.fetch_add(kNext);
    gate_.notify_all();
    for (std::thread& helper : helpers_) helper.join();
}

void Crew::run(Call call, void* job) {
    call_ = call, job_ = job;
    const std::uint32_t number = (gate_.load(std::memory_order_relaxed) & ~(kNext - 1)) + kNext;
    gate_.store(number | kOpen);
    gate_.notify_all();
    call(job, 0);
    std::uint32_t now = gate_.fetch_and(~kOpen, std::memory_order_acq_rel) & ~kOpen;
    for (ShortWait wait; now != number; now = gate_.load(std::memory_order_acquire))
        if (!wait.again()) gate_.wait(now, std::memory_order_acquire);
}

void Crew::help(int thread) {
    const FlushDenormals flush;
    std::uint32_t done = 0;  // number of the last job
    while (true) {
        std::uint32_t now = gate_.load(std::memory_order_acquire);
        for (ShortWait wait; (now & ~(kNext - 1)) == done && !over_;
             now = gate_.load(std::memory_order_acquire))
            if (!wait.again()) gate_.wait(now, std::memory_order_acquire);
        if (over_) return;
        done = now & ~(kNext - 1);
        bool joined = false;
        while (!joined && (now & ~(kNext - 1)) == done && (now & kOpen) != 0)
            joined = gate_.compare_exchange_weak(now, now + 1, std::memory_order_acq_rel);
        if (!joined) continue;
        call_(job_, thread);
        if (gate_.fetch_sub(1, std::memory_order_acq_rel) == done + 1)
            gate_.notify_all();  // closed, and the last
    }
}

}  // namespace sim
