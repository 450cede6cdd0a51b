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
constexpr int kNoteOn = 0x99, kNoteOff = 0x89;  // channel 10

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

struct Stroke {
    int tick = 0;
    bool on = false;
    int key = 0, velocity = 0;
    auto order() const { return std::tuple(tick, on, key, velocity); }  // offs before ons
};

std::vector<Stroke> strokes_of(const std::vector<Note>& notes, const Clock& clock) {
    const double ticks_per_sample =
        clock.ticks_per_quarter / (clock.quarter_us / kMicroseconds) / kSampleRate;
    std::vector<Stroke> strokes;
    for (const Note& note : notes) {
        const std::int64_t tick = std::llround(static_cast<double>(note.onset_sample) * ticks_per_sample);
        if (note.midi_note < 0 || note.midi_note > 127 || note.midi_velocity < 1 ||
            note.midi_velocity > 127 || note.onset_sample < 0 || tick > kLastTick - kNoteTicks) {
            throw std::runtime_error(
                "note " + std::to_string(note.id) + ": found key " + std::to_string(note.midi_note) +
                ", velocity " + std::to_string(note.midi_velocity) + ", onset " +
                std::to_string(note.onset_sample) + ", expected key 0-127, velocity 1-127, onset >= 0");
        }
        strokes.push_back({static_cast<int>(tick), true, note.midi_note, note.midi_velocity});
        strokes.push_back({static_cast<int>(tick) + kNoteTicks, false, note.midi_note, 0});
    }
    std::ranges::sort(strokes, {}, &Stroke::order);
    return strokes;
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

Bytes track_of(const std::vector<Stroke>& strokes, const MidiTime& time, const Clock& clock) {
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
    for (const Stroke& stroke : strokes) {
        append_delta(track, stroke.tick - tick);
        for (const int byte : {stroke.on ? kNoteOn : kNoteOff, stroke.key, stroke.velocity})
            track.push_back(static_cast<std::uint8_t>(byte));
        tick = stroke.tick;
    }
    track.push_back(0);
    track.insert(track.end(), kEnd.begin(), kEnd.end());
    return track;
}

}  // namespace

std::vector<std::uint8_t> encode_midi(const std::vector<Note>& notes, const MidiTime& time) {
    const Clock clock = clock_of(time);
    const Bytes track = track_of(strokes_of(notes, clock), time, clock);
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
