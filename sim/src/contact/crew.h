#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace sim {

/// Denormal numbers count as zero while one lives: below 1e-308 (1e-38 in single precision) they slow the processor down and
/// mean nothing. Also makes the result independent of how the thread was set up.
class FlushDenormals {
public:
    FlushDenormals();
    ~FlushDenormals();
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
    unsigned before_;
};

/// Waits for what another thread does in less time than a sleep takes: a few microseconds awake, then letting others run.
class ShortWait {
public:
    /// Waits for a moment; false: it has waited for long by now.
    bool again() noexcept;

private:
    int rounds_ = 0;
};

/// The thread that owns it and helpers, which share out what the owner hands them. A job is a function that every thread
/// that comes in time calls; it takes pieces by itself until none is left, so a helper that the system does not run delays
/// nothing unless it has a piece. Between jobs helpers wait awake for some tens of microseconds, then asleep.
/// No allocation but in the constructor. Jobs must not throw.
class Crew {
public:
    /// With the owner's; fewer where the system does not start so many.
    explicit Crew(int threads = 1);
    ~Crew();
    Crew(const Crew&) = delete;
    Crew& operator=(const Crew&) = delete;

    [[nodiscard]] int size() const noexcept { return 1 + static_cast<int>(helpers_.size()); }

    /// Calls job(thread) in the owner, as thread 0, and in some helpers, 1 to size() - 1; returns when all calls have.
    template <typename Job>
    void work(Job&& job) {
        if (helpers_.empty()) return job(0);
        run([](void* of, int thread) { (*static_cast<std::remove_reference_t<Job>*>(of))(thread); }, &job);
    }

    /// Calls visit(thread, first, last) for ranges that make up 0 to count, in any order and at the same time.
    template <typename Visit>
    void each(std::size_t count, std::size_t piece, Visit&& visit) {
        if (size() == 1 || count <= piece) {
            if (count > 0) visit(0, std::size_t{0}, count);
            return;
        }
        std::atomic<std::size_t> next = 0;
        work([&](int thread) {
            for (std::size_t at; (at = next.fetch_add(piece, std::memory_order_relaxed)) < count;)
                visit(thread, at, std::min(at + piece, count));
        });
    }

private:
    using Call = void (*)(void* job, int thread);
    void run(Call call, void* job);
    void help(int thread);

    Call call_ = nullptr;
    void* job_ = nullptr;
    // The job's number in the upper half; whether it can still be joined; helpers in it.
    static constexpr std::uint32_t kOpen = 1u << 15, kNext = 1u << 16;
    alignas(64) std::atomic<std::uint32_t> gate_ = 0;
    alignas(64) std::atomic<bool> over_ = false;
    std::vector<std::thread> helpers_;
};

}  // namespace sim
