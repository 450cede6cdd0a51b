#include <algorithm>
#include <array>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <tuple>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr int kTicksPerQuarter = 960;
constexpr std::int64_t kSamplesPerTick = kSampleRate / (2 * kTicksPerQuarter);     // 25: 1920 ticks a second
constexpr int kNoteTicks = 192;                                                    // 0.1 s
constexpr std::int64_t kLastTick = 0x0FFFFFFF;                                     // a delta time has 28 bits
constexpr std::array<std::uint8_t, 6> kTempo{0xFF, 0x51, 0x03, 0x07, 0xA1, 0x20};  // 500000 us a quarter
constexpr std::array<std::uint8_t, 3> kEnd{0xFF, 0x2F, 0x00};
constexpr int kNoteOn = 0x99, kNoteOff = 0x89;  // channel 10

struct Stroke {
    int tick = 0;
    bool on = false;
    int key = 0, velocity = 0;
    auto order() const { return std::tuple(tick, on, key, velocity); }  // offs before ons
};

std::vector<Stroke> strokes_of(const std::vector<Note>& notes) {
    std::vector<Stroke> strokes;
    for (const Note& note : notes) {
        const std::int64_t tick = (note.onset_sample + kSamplesPerTick / 2) / kSamplesPerTick;
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

Bytes track_of(const std::vector<Stroke>& strokes) {
    Bytes track = {0};
    track.insert(track.end(), kTempo.begin(), kTempo.end());
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

std::vector<std::uint8_t> encode_midi(const std::vector<Note>& notes) {
    const Bytes track = track_of(strokes_of(notes));
    Bytes file = {'M', 'T', 'h', 'd'};
    append(file, 6, 4);
    append(file, 0, 2);  // format
    append(file, 1, 2);  // tracks
    append(file, kTicksPerQuarter, 2);
    for (const char c : {'M', 'T', 'r', 'k'}) file.push_back(static_cast<std::uint8_t>(c));
    append(file, static_cast<std::uint32_t>(track.size()), 4);
    file.insert(file.end(), track.begin(), track.end());
    return file;
}

}  // namespace audio
