#include "audio/midi_reader.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace audio {
namespace {

constexpr double kDefaultQuarterUs = 500000, kSecondUs = 1e6;
constexpr int kMeta = 0xFF, kTempo = 0x51, kEndOfTrack = 0x2F, kExclusive = 0xF0, kEscape = 0xF7;
constexpr std::size_t kDeltaBytes = 4, kMostEvents = 1'000'000;

/// The bytes from a place on, with that place for messages.
class MidiBytes {
public:
    MidiBytes(std::string_view bytes, const std::string& file)
        : bytes_(bytes), file_(file), end_(bytes.size()) {}

    [[nodiscard]] std::size_t at() const { return at_; }
    [[nodiscard]] bool ended() const { return at_ >= end_; }
    /// What follows ends here; the former end is returned.
    std::size_t set_end(std::size_t end) { return std::exchange(end_, end); }
    [[nodiscard]] std::size_t left() const { return end_ - at_; }

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
        throw std::runtime_error(file_ + ": error: found " + found + " at byte " + std::to_string(at_) +
                                 ", expected " + expected);
    }
    int byte(const char* expected) {
        if (ended()) fail("the end", expected);
        return static_cast<unsigned char>(bytes_[at_++]);
    }
    int data(const char* expected) {
        const int value = byte(expected);
        if (value < 0x80) return value;
        --at_;
        fail("a byte of " + std::to_string(value), expected);
    }
    /// The most significant byte first.
    std::uint32_t number(int count, const char* expected) {
        std::uint32_t value = 0;
        for (int i = 0; i < count; ++i) value = value << 8 | static_cast<std::uint32_t>(byte(expected));
        return value;
    }
    /// Seven bits a byte, the top bit set on all but the last.
    std::uint32_t quantity(const char* expected) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < kDeltaBytes; ++i) {
            const int next = byte(expected);
            value = value << 7 | static_cast<std::uint32_t>(next & 0x7F);
            if (next < 0x80) return value;
        }
        fail("a number of more than four bytes", expected);
    }
    std::string_view word(std::size_t count, const char* expected) {
        if (left() < count) fail("the end", expected);
        const std::string_view found = bytes_.substr(at_, count);
        at_ += count;
        return found;
    }
    void skip(std::size_t count, const char* expected) {
        if (left() < count)
            fail(std::to_string(left()) + " bytes to the end",
                 std::string(expected) + " of " + std::to_string(count));
        at_ += count;
    }

private:
    std::string_view bytes_;
    const std::string& file_;
    std::size_t at_ = 0, end_;
};

struct FileEvent {
    std::int64_t tick = 0;
    MidiMessage message{};
    double quarter_us = 0;  ///< above 0: a tempo instead
};

/// A channel message; `first`: its first data byte was read already (running status).
MidiMessage channel_message(MidiBytes& in, int status, int first) {
    const int kind = status & 0xF0;
    const bool two = kind != 0xC0 && kind != 0xD0;
    const int data1 = first >= 0 ? first : in.data("a data byte below 128");
    const int data2 = two ? in.data("a data byte below 128") : 0;
    return {0, static_cast<std::uint8_t>(status), static_cast<std::uint8_t>(data1),
            static_cast<std::uint8_t>(data2)};
}

/// Whether anybody asks for such a message.
bool is_kept(const MidiMessage& message) {
    return message.kind() == kMidiNoteOn || message.kind() == kMidiAftertouch ||
           message.kind() == kMidiController;
}

/// One track, whose end is the reader's.
void read_track(MidiBytes& in, std::vector<FileEvent>& events) {
    std::int64_t tick = 0;
    int running = 0;
    const auto keep = [&](const FileEvent& event) {
        if (events.size() == kMostEvents)
            in.fail("more than " + std::to_string(kMostEvents) + " notes, controllers and tempos", "fewer");
        events.push_back(event);
    };
    while (!in.ended()) {
        tick += in.quantity("a delta time");
        const int byte = in.byte("an event");
        if (byte == kMeta) {
            const int type = in.byte("the type of a meta event");
            const std::uint32_t length = in.quantity("the length of a meta event");
            if (type == kEndOfTrack) return in.skip(in.left(), "the end of the track");
            if (type == kTempo && length == 3) {
                const std::uint32_t quarter_us = in.number(3, "a tempo");
                if (quarter_us == 0) in.fail("a tempo of 0", "microseconds a quarter");
                keep({tick, {}, static_cast<double>(quarter_us)});
            } else {
                in.skip(length, "a meta event");
            }
        } else if (byte == kExclusive || byte == kEscape) {
            in.skip(in.quantity("the length of a message"), "a message");
            running = 0;
        } else if (byte >= 0xF0) {
            in.fail("status " + std::to_string(byte), "a message that a file may hold");
        } else {
            if (byte >= 0x80) running = byte;
            if (running == 0) in.fail("data byte " + std::to_string(byte), "a status byte first");
            const MidiMessage message = channel_message(in, running, byte < 0x80 ? byte : -1);
            if (is_kept(message)) keep({tick, message});
        }
    }
}

/// Seconds a tick with an SMPTE division, ticks a quarter otherwise.
struct Division {
    double tick_s = 0, ticks_per_quarter = 0;
};
Division division_of(MidiBytes& in) {
    const std::uint32_t division = in.number(2, "a division");
    if ((division & 0x8000U) == 0) {
        if (division == 0) in.fail("a division of 0", "ticks a quarter");
        return {0, static_cast<double>(division)};
    }
    const int frames = 256 - static_cast<int>(division >> 8), ticks = static_cast<int>(division & 0xFFU);
    if ((frames != 24 && frames != 25 && frames != 29 && frames != 30) || ticks == 0)
        in.fail(std::to_string(frames) + " frames a second of " + std::to_string(ticks) + " ticks",
                "24, 25, 29 or 30 frames, of ticks");
    const double rate = frames == 29 ? 30 / 1.001 : frames;
    return {1 / (rate * ticks), 0};
}

}  // namespace

std::vector<MidiMessage> parse_midi(std::string_view bytes, const std::string& file) {
    MidiBytes in(bytes, file);
    if (bytes.size() > kLargestMidiFile) in.fail("more than 16 MiB", "a smaller MIDI file");
    if (in.word(4, "MThd") != "MThd") in.fail("something else", "MThd, the head of a MIDI file");
    const std::uint32_t head = in.number(4, "the head's length");
    if (head < 6) in.fail("a head of " + std::to_string(head) + " bytes", "6 or more");
    const std::uint32_t format = in.number(2, "a format"), tracks = in.number(2, "the number of tracks");
    if (format > 1) in.fail("format " + std::to_string(format), "0 or 1");
    const Division division = division_of(in);
    in.skip(head - 6, "the head");
    std::vector<FileEvent> events;
    for (std::uint32_t read = 0; read < tracks;) {
        const std::string_view kind = in.word(4, "a track");
        const std::uint32_t length = in.number(4, "a track's length");
        if (in.left() < length)
            in.fail(std::to_string(in.left()) + " bytes to the end", "a track of " + std::to_string(length));
        const std::size_t whole = in.set_end(in.at() + length);
        if (kind == "MTrk") {
            read_track(in, events);
            ++read;
        } else {
            in.skip(length, "a chunk");
        }
        in.set_end(whole);
    }
    std::ranges::stable_sort(events, {}, &FileEvent::tick);
    std::vector<MidiMessage> messages;
    double t_s = 0, quarter_us = kDefaultQuarterUs;
    std::int64_t tick = 0;
    for (FileEvent& event : events) {
        const auto ticks = static_cast<double>(event.tick - tick);
        t_s += division.tick_s > 0 ? ticks * division.tick_s
                                   : ticks / division.ticks_per_quarter * quarter_us / kSecondUs;
        tick = event.tick;
        if (event.quarter_us > 0) {
            quarter_us = event.quarter_us;
            continue;
        }
        event.message.t_s = t_s;
        messages.push_back(event.message);
    }
    return messages;
}

}  // namespace audio
