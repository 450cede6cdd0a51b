#pragma once
#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

namespace audio {

/// Bounded first-in first-out queue between one writing and one reading thread. Both sides wait where they
/// cannot go on (an offline performance loses nothing); neither takes a lock. Positions only grow; element i
/// lies in slot i mod capacity. The writer owns the slots from written_ on, the reader those from read_ to
/// written_; the release of a position by its owner hands the slot over.
///
/// A queue is used either by push and pop or by try_push and try_pop, which never wait, wake no thread and
/// make no system call (real time). Their positions are sequentially consistent: what try_push has returned
/// from is found by every try_pop that follows, in the single order of such operations, any later one of the
/// writer.
template <class T>
class CommandQueue {
public:
    explicit CommandQueue(std::size_t capacity) : slots_(capacity) {}

    /// Writing thread only; waits while the queue is full.
    void push(T value) {
        const std::size_t at = written_.load(std::memory_order_relaxed);
        for (std::size_t read = read_.load(std::memory_order_acquire); at - read == slots_.size();
             read = read_.load(std::memory_order_acquire)) {
            read_.wait(read, std::memory_order_acquire);
        }
        slots_[at % slots_.size()] = std::move(value);
        written_.store(at + 1, std::memory_order_release);
        written_.notify_one();
    }

    /// Reading thread only; waits while the queue is empty.
    [[nodiscard]] T pop() {
        const std::size_t at = read_.load(std::memory_order_relaxed);
        written_.wait(at, std::memory_order_acquire);
        T value = std::move(slots_[at % slots_.size()]);
        read_.store(at + 1, std::memory_order_release);
        read_.notify_one();
        return value;
    }

    /// Writing thread only; false where the queue is full.
    [[nodiscard]] bool try_push(const T& value) noexcept {
        const std::size_t at = written_.load(std::memory_order_relaxed);
        if (at - read_.load(std::memory_order_acquire) == slots_.size()) return false;
        slots_[at % slots_.size()] = value;
        written_.store(at + 1, std::memory_order_seq_cst);
        return true;
    }

    /// Reading thread only; false where the queue is empty.
    [[nodiscard]] bool try_pop(T& value) noexcept {
        const std::size_t at = read_.load(std::memory_order_relaxed);
        if (written_.load(std::memory_order_seq_cst) == at) return false;
        value = std::move(slots_[at % slots_.size()]);
        read_.store(at + 1, std::memory_order_release);
        return true;
    }

private:
    std::vector<T> slots_;
    std::atomic<std::size_t> written_{0};
    std::atomic<std::size_t> read_{0};
};

}  // namespace audio
