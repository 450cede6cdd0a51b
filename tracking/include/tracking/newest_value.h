#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

namespace tracking {

/// Whether copying the bytes of a T copies its value. To be specialised for types that are nothing but
/// numbers though the language cannot know it: Eigen writes out the copy constructors of its fixed-size
/// vectors.
template <class T>
inline constexpr bool kCopiesAsBytes = std::is_trivially_copyable_v<T>;

/// The newest value of one writer for any readers, in memory that processes share (in a mapping whose bytes
/// are zero at first: `at`).
///
///   newest       n: how many values have been published
///   slot n mod 4 its words, and a sequence number: 2n once value n is complete, 2n - 1 while it is written
///
/// A reader takes n, and the words of its slot if the sequence is 2n before and after. That slot is written
/// again after three more publications, so only a reader that is overtaken by them has to try again. Words
/// are atomic: stored with release and loaded with acquire, so that a reader that sees a word of a later
/// value also sees the odd sequence stored before it. No fences, no locks: the writer never waits, and a
/// reader tries the newest slot at most four times, then those before it once each, whatever happens to the
/// writer in between (also SIGKILL in mid-write: the value is not counted, and the next one takes its slot).
/// What one reader gets is never older than what it got before. One writer at a time; a new writer process
/// goes on where a dead one stopped.
template <class T>
class NewestValue {
    static_assert(kCopiesAsBytes<T> && sizeof(T) % sizeof(std::uint64_t) == 0);
    static_assert(std::is_trivially_destructible_v<T> && std::is_default_constructible_v<T>);
    static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

public:
    /// The one whose bytes are at `memory`, all zero before the first publication; `memory` on a page
    /// boundary.
    [[nodiscard]] static NewestValue& at(void* memory) noexcept { return *static_cast<NewestValue*>(memory); }

    void publish(const T& value) noexcept {
        const std::uint64_t n = newest_.load(std::memory_order_acquire) + 1;
        Slot& slot = slots_[n % kSlots];
        slot.sequence.store(2 * n - 1, std::memory_order_relaxed);
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        for (std::size_t i = 0; i < kWords; ++i) {
            std::uint64_t word;
            std::memcpy(&word, bytes + i * sizeof word, sizeof word);
            slot.words[i].store(word, std::memory_order_release);
        }
        slot.sequence.store(2 * n, std::memory_order_release);
        newest_.store(n, std::memory_order_release);
    }

    /// None before the first publication, and where the writer published three more values within the time of
    /// each of the tries: never seen up to 1 kHz, up to one read in 100 of a writer without any pause.
    [[nodiscard]] std::optional<T> read() const noexcept {
        std::optional<T> value(std::in_place);
        for (int attempt = 0; attempt < kTries; ++attempt) {
            const std::uint64_t n = newest_.load(std::memory_order_acquire);
            if (n == 0) break;
            if (copy(n, *value)) return value;
        }
        // After that many tries in vain even the oldest slot is newer than anything read before.
        const std::uint64_t n = newest_.load(std::memory_order_acquire);
        for (std::uint64_t age = 1; age < kSlots && age < n; ++age)
            if (copy(n - age, *value)) return value;
        value.reset();
        return value;
    }

    /// How many values have been published.
    [[nodiscard]] std::uint64_t published() const noexcept { return newest_.load(std::memory_order_acquire); }

private:
    static constexpr std::size_t kSlots = 4, kWords = sizeof(T) / sizeof(std::uint64_t);
    static constexpr int kTries = 4;

    struct alignas(64) Slot {  // a cache line of its own
        std::atomic<std::uint64_t> sequence{};
        std::array<std::atomic<std::uint64_t>, kWords> words{};
    };

    /// Copies value n; false if its slot does not hold it, or not all the while.
    [[nodiscard]] bool copy(std::uint64_t n, T& value) const noexcept {
        const Slot& slot = slots_[n % kSlots];
        if (slot.sequence.load(std::memory_order_acquire) != 2 * n) return false;
        auto* bytes = reinterpret_cast<std::byte*>(&value);
        for (std::size_t i = 0; i < kWords; ++i) {
            const std::uint64_t word = slot.words[i].load(std::memory_order_acquire);
            std::memcpy(bytes + i * sizeof word, &word, sizeof word);
        }
        return slot.sequence.load(std::memory_order_relaxed) == 2 * n;
    }

    alignas(64) std::atomic<std::uint64_t> newest_{};
    std::array<Slot, kSlots> slots_{};
};

}  // namespace tracking
