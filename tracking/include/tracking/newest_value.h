#pragma once
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

namespace tracking {

/// The newest value of one writer for any readers, in memory that processes share (place it in a mapping
/// whose bytes are zero at first). Four slots, each with a sequence number that is odd while the slot is
/// written, and the index of the newest complete one. Words are atomic, stored with release and loaded with
/// acquire; no fences, no locks: the writer never waits, and a reader tries at most four times, then takes
/// the previous complete slot, whatever happens to the writer in between (also SIGKILL in mid-write). One
/// writer at a time; a new writer process goes on where a dead one stopped.
template <class T>
class NewestValue {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint64_t) == 0);

public:
    void publish(const T& value) noexcept;
    /// None before the first publication (or, never seen, when no complete slot could be read).
    [[nodiscard]] std::optional<T> read() const noexcept;

private:
    // ...
};

}  // namespace tracking
