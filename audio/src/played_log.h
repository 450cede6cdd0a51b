#pragma once
#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#include "audio/live_performance.h"

namespace audio {

/// Answers in order, written by one thread and read by another while it grows; room is taken at construction,
/// and neither thread waits.
class PlayedLog {
public:
    explicit PlayedLog(std::size_t capacity) : notes_(capacity) {}

    /// Writing thread; false where there is no room.
    [[nodiscard]] bool try_add(const PlayedNote& note) noexcept {
        const std::size_t count = count_.load(std::memory_order_relaxed);
        if (count == notes_.size()) return false;
        notes_[count] = note;
        count_.store(count + 1, std::memory_order_release);
        return true;
    }

    /// Reading thread: those since the last call.
    [[nodiscard]] std::vector<PlayedNote> take() {
        const std::size_t count = count_.load(std::memory_order_acquire);
        const std::span<const PlayedNote> fresh = std::span(notes_).subspan(read_, count - read_);
        read_ = count;
        return {fresh.begin(), fresh.end()};
    }

private:
    std::vector<PlayedNote> notes_;
    std::atomic<std::size_t> count_{0};
    std::size_t read_ = 0;  // reading thread's
};

}  // namespace audio
