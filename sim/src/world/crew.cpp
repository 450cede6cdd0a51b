#include "world/crew.h"

#include <pmmintrin.h>

#include <system_error>
#include <utility>

#include "world/processor_time.h"

namespace sim {
namespace {

// What a job costs beside its pieces, on two idle cores of an AMD EPYC [s]: until helpers begin, and after the last piece.
constexpr double kHandOut = 1e-6, kTakeBack = 3e-7;

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

ThreadPlan::ThreadPlan(int threads) : free_s_(static_cast<std::size_t>(threads), 0) {
    constexpr int kLooks = 1000;
    const double start = thread_processor_s();
    for (int i = 0; i < kLooks; ++i) marked_s_ = thread_processor_s();
    clock_s_ = (marked_s_ - start) / kLooks;
}

double ThreadPlan::mark() noexcept {
    const double now = thread_processor_s();
    saved_s_ += clock_s_;
    return std::max(0.0, now - std::exchange(marked_s_, now) - clock_s_);
}

void ThreadPlan::begin() noexcept {
    std::fill(free_s_.begin(), free_s_.end(), kHandOut);
    free_s_.front() = sum_s_ = 0;
    (void)mark();
}

int ThreadPlan::next() const noexcept {
    return static_cast<int>(std::min_element(free_s_.begin(), free_s_.end()) - free_s_.begin());
}

double ThreadPlan::done(int thread, double from) noexcept {
    const double took = mark();
    double& free = free_s_[static_cast<std::size_t>(thread)];
    free = std::max(free, from) + took;
    sum_s_ += took;
    return free;
}

void ThreadPlan::end() noexcept {
    double last = free_s_.front();
    for (const double free : free_s_)
        if (free > kHandOut) last = std::max(last, free);
    saved_s_ += sum_s_ - last - kTakeBack;
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
