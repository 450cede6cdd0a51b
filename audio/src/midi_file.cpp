#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <tuple>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr double kTicksPerSecond = 1920, kMicroseconds = 1e6;
constexpr int kNoteTicks = 192;                 // nearly 0.1 s
constexpr std::int64_t kLastTick = 0x0FFFFFFF;  // a delta time has 28 bits
constexpr std::array<std::uint8_t, 3> kEnd{0xFF, 0x2F, 0x00};
constexpr int kNoteOn = 0x99, kNoteOff = 0x89, kAftertouch = 0xA9, kController = 0xB9;  // channel 10

/// A tempo as a file states it.
struct Clock {
    std::uint32_t quarter_us = 500000;
    int ticks_per_quarter = 960;
};

Clock clock_of(const MidiTime& time) {
    const bool is_power = time.beat_unit > 0 && std::has_single_bit(static_cast<unsigned>(time.beat_unit));
    if (!(time.tempo_bpm >= 20 && time.tempo_bpm <= 400) || time.beats < 1 || time.beats > 64 || !is_power ||
        time.beat_unit > 32) {
        throw std::logic_error("MIDI time: found tempo " + std::to_string(time.tempo_bpm) + ", bars of " +
                               std::to_string(time.beats) + "/" + std::to_string(time.beat_unit) +
                               ", expected 20 to 400, 1 to 64 beats, each a 1, 2, 4, 8, 16 or 32");
    }
    const double quarter_s = 60 / time.tempo_bpm;
    return {static_cast<std::uint32_t>(std::lround(quarter_s * kMicroseconds)),
            static_cast<int>(std::lround(quarter_s * kTicksPerSecond))};
}

/// A message of three bytes at its tick.
struct Message {
    int tick = 0;
    std::array<std::uint8_t, 3> bytes{};
    /// Note-offs first, then controllers and chokes, then note-ons.
    auto order() const {
        const int kind = bytes[0] == kNoteOff ? 0 : bytes[0] == kNoteOn ? 2 : 1;
        return std::tuple(tick, kind, bytes);
    }
};

std::array<std::uint8_t, 3> bytes_of(int status, int first, int second) {
    return {static_cast<std::uint8_t>(status), static_cast<std::uint8_t>(first),
            static_cast<std::uint8_t>(second)};
}

bool is_data(int value) {
    return value >= 0 && value <= 127;
}

std::vector<Message> messages_of(const std::vector<Note>& notes, const std::vector<MidiControl>& controls,
                                 const Clock& clock) {
    const double ticks_per_sample =
        clock.ticks_per_quarter / (clock.quarter_us / kMicroseconds) / kSampleRate;
    const auto tick_of = [&](std::int64_t sample) {
        return std::llround(static_cast<double>(sample) * ticks_per_sample);
    };
    std::vector<Message> messages;
    for (const Note& note : notes) {
        if (note.kind == Note::Kind::pedal) continue;
        const std::int64_t at = tick_of(note.onset_sample);
        if (!is_data(note.midi_note) || !is_data(note.midi_velocity) || note.midi_velocity == 0 ||
            note.onset_sample < 0 || at > kLastTick - kNoteTicks) {
            throw std::runtime_error(
                "note " + std::to_string(note.id) + ": found key " + std::to_string(note.midi_note) +
                ", velocity " + std::to_string(note.midi_velocity) + ", onset " +
                std::to_string(note.onset_sample) + ", expected key 0-127, velocity 1-127, onset >= 0");
        }
        const int tick = static_cast<int>(at);
        if (note.kind == Note::Kind::choke) {
            messages.push_back({tick, bytes_of(kAftertouch, note.midi_note, 127)});
            continue;
        }
        messages.push_back({tick, bytes_of(kNoteOn, note.midi_note, note.midi_velocity)});
        messages.push_back({tick + kNoteTicks, bytes_of(kNoteOff, note.midi_note, 0)});
    }
    for (const MidiControl& control : controls) {
        const std::int64_t at = tick_of(control.sample);
        if (!is_data(control.controller) || !is_data(control.value) || control.sample < 0 || at > kLastTick)
            throw std::runtime_error("controller " + std::to_string(control.controller) + ": found value " +
                                     std::to_string(control.value) + ", sample " +
                                     std::to_string(control.sample) + ", expected 0-127, sample >= 0");
        messages.push_back({static_cast<int>(at), bytes_of(kController, control.controller, control.value)});
    }
    std::ranges::sort(messages, {}, &Message::order);
    return messages;
}

using Bytes = std::vector<std::uint8_t>;

/// The most significant byte first.
void append(Bytes& bytes, std::uint32_t number, int count) {
    for (int i = count - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

/// A delta time: seven bits a byte, the most significant first, the top bit set on all but the last.
void append_delta(Bytes& track, int ticks) {
    for (int shift = 21; shift > 0; shift -= 7)
        if (ticks >> shift != 0) track.push_back(static_cast<std::uint8_t>(0x80 | (ticks >> shift & 0x7F)));
    track.push_back(static_cast<std::uint8_t>(ticks & 0x7F));
}

Bytes track_of(const std::vector<Message>& messages, const MidiTime& time, const Clock& clock) {
    Bytes track = {0, 0xFF, 0x51, 0x03};
    append(track, clock.quarter_us, 3);
    if (time.beats != 4 || time.beat_unit != 4) {  // as a file without one is read
        const auto unit = static_cast<std::uint8_t>(std::countr_zero(static_cast<unsigned>(time.beat_unit)));
        const auto clocks = static_cast<std::uint8_t>(96 / time.beat_unit);  // MIDI clocks a beat
        for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{
                 0, 0xFF, 0x58, 0x04, static_cast<std::uint8_t>(time.beats), unit, clocks, 8})
            track.push_back(byte);
    }
    int tick = 0;
    for (const Message& message : messages) {
        append_delta(track, message.tick - tick);
        track.insert(track.end(), message.bytes.begin(), message.bytes.end());
        tick = message.tick;
    }
    track.push_back(0);
    track.insert(track.end(), kEnd.begin(), kEnd.end());
    return track;
}

}  // namespace

std::vector<std::uint8_t> encode_midi(const std::vector<Note>& notes, const MidiTime& time,
                                      const std::vector<MidiControl>& controls) {
    const Clock clock = clock_of(time);
    const Bytes track = track_of(messages_of(notes, controls, clock), time, clock);
    Bytes file = {'M', 'T', 'h', 'd'};
    append(file, 6, 4);
    append(file, 0, 2);  // format
    append(file, 1, 2);  // tracks
    append(file, static_cast<std::uint32_t>(clock.ticks_per_quarter), 2);
    for (const char c : {'M', 'T', 'r', 'k'}) file.push_back(static_cast<std::uint8_t>(c));
    append(file, static_cast<std::uint32_t>(track.size()), 4);
    file.insert(file.end(), track.begin(), track.end());
    return file;
}

}  // namespace audio
