#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace audio {

/// A stroke for another program: key and velocity on channel 10, sounding at due_ns of CLOCK_MONOTONIC.
struct MidiStroke {
    std::int64_t due_ns = 0;
    std::uint8_t key = 0, velocity = 0;
};

/// A MIDI message of three bytes and when it is due.
struct MidiEvent {
    std::int64_t due_ns = 0;
    std::array<std::uint8_t, 3> bytes{};
    [[nodiscard]] bool is_note_on() const noexcept { return bytes[0] == 0x99; }
};

/// Whether these are a message's bytes: a status and two of data, which are below 128.
[[nodiscard]] inline bool is_message(std::span<const std::uint8_t> bytes) noexcept {
    return bytes.size() == 3 && bytes[0] >= 0x80 && bytes[1] < 0x80 && bytes[2] < 0x80;
}

/// Events to come, in order of time: a note-on each stroke and its note-off 0.1 s later, or just before the
/// key's next note-on where that is sooner. Never allocates.
class MidiEvents {
public:
    static constexpr std::size_t kCapacity = 1024;
    static constexpr std::int64_t kLengthNs = 100'000'000;

    /// False where there is no room.
    [[nodiscard]] bool add(const MidiStroke& stroke) noexcept {
        if (count_ + 2 > kCapacity) return false;
        end_key(stroke.key, stroke.due_ns);
        insert({stroke.due_ns, {0x99, stroke.key, stroke.velocity}});
        insert({stroke.due_ns + kLengthNs, {0x89, stroke.key, 0}});
        return true;
    }

    [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
    [[nodiscard]] const MidiEvent& front() const noexcept { return events_.front(); }
    void pop_front() noexcept { erase(events_.begin()); }

private:
    using Iterator = std::array<MidiEvent, kCapacity>::iterator;

    [[nodiscard]] Iterator end() noexcept { return events_.begin() + static_cast<std::ptrdiff_t>(count_); }

    void insert(const MidiEvent& event) noexcept {
        const Iterator at =
            std::upper_bound(events_.begin(), end(), event,
                             [](const MidiEvent& a, const MidiEvent& b) { return a.due_ns < b.due_ns; });
        std::move_backward(at, end(), end() + 1);
        *at = event;
        ++count_;
    }

    void erase(Iterator at) noexcept {
        std::move(at + 1, end(), at);
        --count_;
    }

    /// A note-off of that key after `due_ns` comes at it instead, before what is inserted there next.
    void end_key(std::uint8_t key, std::int64_t due_ns) noexcept {
        const Iterator off = std::find_if(events_.begin(), end(), [&](const MidiEvent& event) {
            return !event.is_note_on() && event.bytes[1] == key && event.due_ns > due_ns &&
                   event.due_ns - kLengthNs < due_ns;
        });
        if (off == end()) return;
        MidiEvent sooner = *off;
        sooner.due_ns = due_ns;
        erase(off);
        insert(sooner);
    }

    std::array<MidiEvent, kCapacity> events_{};
    std::size_t count_ = 0;
};

}  // namespace audio
