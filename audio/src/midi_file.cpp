// smf.h includes glib.h within extern "C", which glib's C++ parts do not bear: glib comes first.
#include <glib.h>
#include <smf.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr int kTicksPerQuarter = 960;
constexpr std::int64_t kSamplesPerTick = kSampleRate / (2 * kTicksPerQuarter);  // 25: 1920 ticks a second
constexpr int kNoteTicks = 192;                                                 // 0.1 s
constexpr std::int64_t kLastTick = 0x0FFFFFFF;                                  // a delta time has 28 bits
constexpr std::array<unsigned char, 6> kTempo{0xFF, 0x51, 0x03, 0x07, 0xA1, 0x20};  // 500000 us a quarter
constexpr int kNoteOn = 0x99, kNoteOff = 0x89;                                      // channel 10

struct Stroke {
    int tick = 0;
    bool on = false;
    int key = 0, velocity = 0;
    auto order() const { return std::tuple(tick, on, key, velocity); }  // offs before ons
};

struct Delete {
    void operator()(smf_t* file) const noexcept { smf_delete(file); }
};

/// Holds back what libsmf would print on standard error while it lives (glib's handlers belong to the
/// process: kept short).
class LogCatcher {
public:
    LogCatcher() : id_(g_log_set_handler("libsmf", G_LOG_LEVEL_MASK, &LogCatcher::receive, this)) {}
    ~LogCatcher() { g_log_remove_handler("libsmf", id_); }
    LogCatcher(const LogCatcher&) = delete;
    LogCatcher& operator=(const LogCatcher&) = delete;
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    static void receive(const gchar*, GLogLevelFlags, const gchar* message, gpointer self) {
        static_cast<LogCatcher*>(self)->text_ = message;
    }
    std::string text_;
    guint id_;
};

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
    throw std::runtime_error(file.string() + ": " + what);
}

std::vector<Stroke> strokes_of(const std::vector<Note>& notes, const std::filesystem::path& file) {
    std::vector<Stroke> strokes;
    for (const Note& note : notes) {
        const std::int64_t tick = (note.onset_sample + kSamplesPerTick / 2) / kSamplesPerTick;
        if (note.midi_note < 0 || note.midi_note > 127 || note.midi_velocity < 1 ||
            note.midi_velocity > 127 || note.onset_sample < 0 || tick > kLastTick - kNoteTicks) {
            fail(file, "note " + std::to_string(note.id) + ": found key " + std::to_string(note.midi_note) +
                           ", velocity " + std::to_string(note.midi_velocity) + ", onset " +
                           std::to_string(note.onset_sample) +
                           ", expected key 0-127, velocity 1-127, onset >= 0");
        }
        strokes.push_back({static_cast<int>(tick), true, note.midi_note, note.midi_velocity});
        strokes.push_back({static_cast<int>(tick) + kNoteTicks, false, note.midi_note, 0});
    }
    std::ranges::sort(strokes, {}, &Stroke::order);
    return strokes;
}

void append(smf_track_t* track, smf_event_t* event, int tick, const std::filesystem::path& file) {
    if (event == nullptr) fail(file, "a MIDI event could not be made");
    smf_track_add_event_pulses(track, event, tick);
}

}  // namespace

void write_midi(const std::filesystem::path& file, const std::vector<Note>& notes) {
    const std::vector<Stroke> strokes = strokes_of(notes, file);
    const std::unique_ptr<smf_t, Delete> midi(smf_new());
    if (!midi || smf_set_format(midi.get(), 0) != 0 || smf_set_ppqn(midi.get(), kTicksPerQuarter) != 0) {
        fail(file, "the MIDI header could not be made");
    }
    smf_track_t* track = smf_track_new();
    if (track == nullptr) fail(file, "the MIDI track could not be made");
    smf_add_track(midi.get(), track);
    std::array<unsigned char, 6> tempo = kTempo;
    append(track, smf_event_new_from_pointer(tempo.data(), static_cast<int>(tempo.size())), 0, file);
    for (const Stroke& stroke : strokes) {
        append(track, smf_event_new_from_bytes(stroke.on ? kNoteOn : kNoteOff, stroke.key, stroke.velocity),
               stroke.tick, file);
    }
    const LogCatcher log;
    if (smf_save(midi.get(), file.c_str()) != 0) {
        fail(file, "writing failed (" + log.text() + "), expected a writable file with room for it");
    }
}

}  // namespace audio
