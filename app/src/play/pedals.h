#pragma once
#include <audio/midi_reader.h>
#include <audio/performance.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kit/kit.h"

namespace app {

/// What a foot or a hand does at a moment.
struct PedalMove {
    enum class Kind : std::uint8_t {
        place,   ///< the pedal of a hi-hat or a damper goes to `value`: 0 closed or damped ... 1 open or free
        stroke,  ///< a beater strikes at `value` m/s
        foot,    ///< a hi-hat is closed by the foot with a sound of `value` m/s, and opened again as it was
        choke,   ///< a hand ends what rings
        tip,     ///< the tip of a stick, likewise
    } kind = Kind::place;
    double t_s = 0;
    std::uint32_t instrument = 0;
    double value = 0;
    std::uint32_t stick = 0;  ///< whose tip it is
};

inline constexpr std::size_t kMostPedalMoves = 1'000'000;

/// Reads a schedule (CSV, `t,pedal,value`; t on the trace's clock [s], not falling; pedal the instrument's name; value 0
/// to 1) or a Standard MIDI File, whose time 0 is t0_s. Throws BadInput with the place.
[[nodiscard]] std::vector<PedalMove> read_pedals(const std::filesystem::path& file, const Kit& kit,
                                                 double t0_s);
/// The same of a schedule's text. (Fuzzed.)
[[nodiscard]] std::vector<PedalMove> parse_pedals(std::string_view text, const std::string& file,
                                                  const Kit& kit);
/// Removes moves that cannot be heard between t0_s and t_end_s, and returns their number; places before t0_s
/// stay.
[[nodiscard]] std::size_t leave_out(std::vector<PedalMove>& moves, double t0_s, double t_end_s);
/// The moves that a MIDI message, of any channel, stands for, at its own time:
///   controller 4 (foot)       every hi-hat: openness 1 - value / 127
///   controller 64 (sustain)   every damper: value / 127
///   note on                   every beater whose instrument has that note in a zone (35 and 36 count as one): a stroke
///                             of 8 m/s (velocity / 127)^(1 / 0.7); every hi-hat with that foot_note: `foot`
///   polyphonic aftertouch     of 64 and more: chokes every instrument that has that note
[[nodiscard]] std::vector<PedalMove> moves_of(const audio::MidiMessage& message, const Kit& kit);

/// A note that a pedal or a hand plays; its id counts from kFirstPedalId.
struct PedalNote {
    audio::Note note;
    PedalMove::Kind by = PedalMove::Kind::stroke;
    double t_s = 0;           ///< of the move
    std::uint32_t stick = 0;  ///< of a tip
};
[[nodiscard]] inline bool is_choke(const PedalNote& note) {
    return note.note.kind == audio::Note::Kind::choke;
}
inline constexpr std::uint64_t kFirstPedalId = 1'000'000'000;
/// Ids of notes that only carry a pedal's position count from here.
inline constexpr std::uint64_t kFirstPlaceId = 2'000'000'000;

/// The positions of a kit's pedals over time, and the notes that they play.
///
/// A hi-hat or damper that comes to 0.1 or below ends the sound of its instrument, within 15 ms from that
/// sample on. A hi-hat that closes fast plays a note: its plates have 30 mm to go, and the note is a stroke
/// at their mean speed since the pedal began to fall; a single step counts as a fall of 15 ms; below 0.2 m/s
/// there is no note. Drum modules send both the pedal's position and a message that it closed: within 50 ms
/// both are one note. A stroke gets the pedal's place at its onset; places() carry the pedals' positions to
/// sounds that go on.
class Pedals {
public:
    Pedals() = default;
    /// t0_s: time of sample 0.
    Pedals(const Kit& kit, double t0_s);

    /// Takes a move; those of pedals come in order of time. Moves before sample 0 only set places. The notes
    /// that it plays are added to notes(); their onset is the move's time, or `earliest` where that is later.
    void take(const PedalMove& move, std::int64_t earliest = 0);
    /// All pedals go back to rest at that sample, without a sound.
    void rest(std::int64_t sample);
    /// The run ends at that sample: what the pedals did later is forgotten.
    void end_at(std::int64_t sample);
    /// Gives the stroke of a stick the pedal's place, and the MIDI note that goes with it.
    void put_on(audio::Note& note) const;

    [[nodiscard]] const std::vector<PedalNote>& notes() const { return notes_; }
    /// Notes of the kind `pedal`, in the order of the moves.
    [[nodiscard]] const std::vector<audio::Note>& places() const { return places_; }
    /// Controller 4 as the hi-hats moved.
    [[nodiscard]] std::vector<audio::MidiControl> controls() const;
    /// The number of moves taken, of pedals and hands.
    [[nodiscard]] std::size_t moves() const { return moves_; }

private:
    struct Step {
        std::int64_t sample;
        double place;
    };
    struct Foot {
        Pedal pedal;
        double rest = 0, place = 0;
        double last_s = 0, fall_began_s = 0, fell_from = 0;
        bool falling = false, closed = false;
        double sounded_s = -1e9;    ///< it closed last
        std::int64_t ended = -1;    ///< sample at which it ended last
        std::vector<Step> steps{};  ///< by sample
        audio::Note stroke{};       ///< what a note of its own begins as
    };
    void step(Foot& foot, std::int64_t sample);
    void move_to(Foot& foot, const PedalMove& move, std::int64_t sample);
    void sound(Foot& foot, const PedalMove& move, std::int64_t sample, double speed_mps);
    void end(Foot& foot, const PedalMove& move, std::int64_t sample);
    void add(const audio::Note& note, const PedalMove& move);

    double t0_s_ = 0;
    std::vector<Foot> feet_;  // by instrument
    std::vector<PedalNote> notes_;
    std::vector<audio::Note> places_;
    std::size_t moves_ = 0;
};

}  // namespace app
