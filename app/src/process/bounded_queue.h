#pragma once
#include <atomic>
#include <cstddef>
#include <semaphore>
#include <utility>
#include <vector>

namespace app {

/// A queue of at most `capacity` items from one thread to another. No locks: a thread that is not scheduled
/// for a while never holds up the other one, as long as there is room and something to take. Any thread may
/// close it.
template <class Item>
class BoundedQueue {
public:
    explicit BoundedQueue(std::size_t capacity)
        : slots_(capacity), room_(static_cast<std::ptrdiff_t>(capacity)) {}

    /// Adds an item; waits for room. False: the queue is closed.
    bool push(Item item) {
        room_.acquire();
        return put(std::move(item));
    }
    /// Adds an item if there is room. False: there is none, or the queue is closed.
    [[nodiscard]] bool try_push(Item item) { return room_.try_acquire() && put(std::move(item)); }
    /// Takes the oldest item; waits for one. False: the queue is closed and empty.
    bool pop(Item& item) {
        filled_.acquire();
        if (taken_ == put_.load(std::memory_order_acquire)) {
            filled_.release();  // for the next call
            return false;
        }
        item = std::move(slots_[taken_++ % slots_.size()]);
        room_.release();
        return true;
    }
    /// Takes the oldest item if there is one.
    [[nodiscard]] bool try_pop(Item& item) {
        if (!filled_.try_acquire()) return false;
        filled_.release();
        return pop(item);
    }
    /// Nothing is added any more; what is there can still be taken. Wakes threads that wait.
    void close() {
        closed_.store(true, std::memory_order_release);
        room_.release();
        filled_.release();
    }

private:
    bool put(Item item) {
        if (closed_.load(std::memory_order_acquire)) {
            room_.release();  // for the next call
            return false;
        }
        const std::size_t at = put_.load(std::memory_order_relaxed);
        slots_[at % slots_.size()] = std::move(item);
        put_.store(at + 1, std::memory_order_release);
        filled_.release();
        return true;
    }

    std::vector<Item> slots_;
    std::counting_semaphore<> room_, filled_{0};
    std::atomic<std::size_t> put_ = 0;  // items ever added
    std::size_t taken_ = 0;             // items ever taken; of the taking thread alone
    std::atomic<bool> closed_ = false;
};

}  // namespace app
