#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>
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
    /// Once more; false: it takes longer.
    bool again() noexcept;

private:
    int rounds_ = 0;
};

/// What pieces of jobs, done one after the other by one thread, would take several: each goes to the one that would be free
/// first, as from Crew. By processor time, so that other load does not count; the clock's own time is left out.
class ThreadPlan {
public:
    explicit ThreadPlan(int threads);
    [[nodiscard]] int threads() const noexcept { return static_cast<int>(free_s_.size()); }

    void begin() noexcept;                    ///< a job
    [[nodiscard]] int next() const noexcept;  ///< who takes the next piece
    /// This thread has done the piece of `thread`, which begins at `from` at the earliest. When it ends. Times since the
    /// job's begin [s].
    double done(int thread, double from = 0) noexcept;
    void end() noexcept;
    /// Processor time of this thread so far that would not have passed [s].
    [[nodiscard]] double saved_s() const noexcept { return saved_s_; }

private:
    double mark() noexcept;  ///< processor time since the last one [s]

    std::vector<double> free_s_;
    double clock_s_ = 0;  // what a look at the clock takes
    double marked_s_ = 0, sum_s_ = 0, saved_s_ = 0;
};

/// The thread that owns it and helpers, which share out what the owner hands them. A job is a function that every thread
/// that comes in time calls; it takes pieces by itself until none is left, so a helper that the system does not run delays
/// nothing unless it has a piece. Between jobs helpers wait awake for some tens of microseconds, then asleep.
/// No allocation but in the constructor. Jobs must not throw.
class Crew {
public:
    /// With the owner's; fewer where the system does not start so many.
    explicit Crew(int threads = 1);
    /// The owner alone does what they would share out, and plans it.
    explicit Crew(const ThreadPlan& plan) : plan_(plan) {}
    ~Crew();
    Crew(const Crew&) = delete;
    Crew& operator=(const Crew&) = delete;

    [[nodiscard]] int size() const noexcept {
        return plan_ ? plan_->threads() : 1 + static_cast<int>(helpers_.size());
    }
    [[nodiscard]] ThreadPlan* plan() noexcept { return plan_ ? &*plan_ : nullptr; }  ///< null: none

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
        if (plan_) {
            plan_->begin();
            for (std::size_t at = 0; at < count; at += piece) {
                const int thread = plan_->next();
                visit(thread, at, std::min(at + piece, count));
                plan_->done(thread);
            }
            return plan_->end();
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
    std::optional<ThreadPlan> plan_;
};

}  // namespace sim
