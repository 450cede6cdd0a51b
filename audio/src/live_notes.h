#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "audio/performance.h"

namespace audio {

/// A note whose block has begun.
struct TakenNote {
    Note note;  ///< its onset_sample is the one that sounds
    std::int64_t planned_sample =
        0;  ///< and this the one that was asked for; earlier where the note came too late
};

/// The notes ahead of the sound, which may still be moved and cancelled, in order of onset (then id). Memory
/// is taken at construction only. An id is known as taken until 4096 other notes were.
class LiveNotes {
public:
    enum class Answer { accepted, too_late, full };
    explicit LiveNotes(std::size_t capacity) : notes_(capacity) { notes_.clear(); }

    /// Adds or replaces (same id) a note; too_late: it has been taken.
    [[nodiscard]] Answer put(const Note& note) noexcept;
    /// too_late: it has been taken, or is not known.
    [[nodiscard]] Answer cancel(std::uint64_t id) noexcept;
    /// Takes out the notes before `end`, at most as many as `taken` has room for. Those before `begin` get it
    /// as their onset. Ordered as they sound: by that onset, then by id.
    void take_before(std::int64_t end, std::int64_t begin, std::vector<TakenNote>& taken) noexcept;

private:
    [[nodiscard]] bool erase(std::uint64_t id) noexcept;
    [[nodiscard]] bool was_taken(std::uint64_t id) const noexcept;

    std::vector<Note> notes_;
    std::array<std::uint64_t, 4096> taken_{};  ///< the last ids, a ring; 0 is no id
    std::size_t taken_count_ = 0;
};

}  // namespace audio
