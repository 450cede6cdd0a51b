#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/performance.h"
#include "csound_engine.h"
#include "onset_rule.h"
#include "room.h"
#include "sample_voice.h"

namespace audio {

/// A voice as the orchestra wants it.
struct RenderedVoice {
    double instrument = 0;       ///< number in Csound
    double left = 0, right = 0;  ///< gains: constant power pan times the voice's gain
    int choke_group = -1;
    std::vector<double> parameters;          ///< in the declared order, p12 on
    std::vector<double> pedal_parameters{};  ///< the same at the far end of its pedal's way
    std::optional<std::size_t>
        decay{};  ///< which of them is decay_s, with which what rings follows the pedal
    std::optional<SampleVoice> samples{};  ///< recorded sounds instead, of all parameters only with that
};

/// Constant power: left^2 + right^2 = gain^2, pan 0 left ... 1 right.
struct PanGains {
    double left = 0, right = 0;
};
[[nodiscard]] PanGains pan_gains(double pan, double gain_db);

/// Turns notes into samples, block by block; everything on one thread.
///
/// A note is handed to Csound just before the block that holds its onset, so Csound never knows a note that
/// can still be cancelled. Choking: before a block the host writes into table 901, for each voice, the first onset within
/// it of what chokes that voice (a note of its group, or a choke of its own); every older note of the voice fades from that
/// very sample; a note started in the same block gets the next later one there as p11. Equal onsets do not choke each
/// other.
///
/// Pedals: before a block table 904 gets, for each voice, the decay time of its pedal's place as the last move before
/// the block or a stroke within it says, and the longest. The bundled instruments take their modes' decay from it; recorded
/// sounds and orchestras of one's own are damped as a whole (PedalGain in opcodes.cpp).
class Renderer {
public:
    /// Throws std::runtime_error: orchestra, instrument, parameter, pan, gain or room that is not valid.
    Renderer(const std::filesystem::path& orchestra, const std::vector<Voice>& voices, const Mix& mix);

    [[nodiscard]] int block_size() const { return engine_.block_size(); }
    [[nodiscard]] std::string version() const;
    [[nodiscard]] std::int64_t position() const { return position_; }  ///< first sample of the coming block

    /// Runs notes of every voice, choked at once, before the first block, so that their code and their memory
    /// in Csound are in place. They leave no trace in what is rendered. False where that cannot be had (an
    /// instrument that does not obey p11): then a new renderer is needed.
    [[nodiscard]] bool warm_up();

    /// Notes come in order of onset, each before its block is rendered.
    void add(const Note& note) { due_.push_back(note); }
    /// Renders the next block and appends it to `output`, interleaved stereo, which grows only beyond its
    /// capacity. Itself it allocates nothing while notes are added a block at a time (Csound may).
    void render_block(std::vector<float>& output);
    /// Renders whole blocks up to `sample`, a multiple of the block size.
    void render_to(std::int64_t sample, std::vector<float>& output);
    /// Whether more blocks are to be rendered until what Performance::finish says is there.
    [[nodiscard]] bool goes_on(std::int64_t minimum_samples, std::int64_t tail_samples) const;
    /// Throws std::runtime_error if an instrument gave samples that are no numbers: they are silence in what was rendered.
    void require_numbers() const;
    /// How much of all that was rendered is then kept.
    [[nodiscard]] std::int64_t kept_samples(std::int64_t minimum_samples, std::int64_t tail_samples) const;

private:
    Renderer(const std::string& text, const std::string& source, const std::vector<Voice>& voices,
             const Mix& mix);
    void start_event(const Note& note, std::int64_t choke_sample, PanGains gains,
                     std::span<const double> parameters);
    void start_due_notes();
    void mark_chokes(std::span<const Note> notes);
    void mark_pedals(std::span<const Note> notes);
    void set_pedal(std::uint32_t voice, double place);
    void start(const Note& note, std::span<const Note> block_notes);
    void start_choked(const Note& note, std::int64_t choke_sample);  ///< p11; -1: none
    [[nodiscard]] bool chokes(const Note& note, std::uint32_t voice) const;
    [[nodiscard]] std::span<const double> parameters_of(const Note& note);
    [[nodiscard]] bool sounding() const;

    CsoundEngine engine_;
    OnsetRule rule_;
    Mix mix_;
    Room room_;
    std::vector<RenderedVoice> voices_;
    std::span<double> chokes_;  ///< table 901
    std::span<double> ends_;    ///< table 902
    std::span<double> decays_;  ///< table 904; empty without such a pedal
    std::vector<Note> due_;     ///< from next_due_ on still to be started
    std::size_t next_due_ = 0;
    std::vector<double> p_fields_, pressed_;  ///< pressed_: a note's parameters by its pedal
    std::vector<double> coming_;              ///< places of pedals from the next block on; below 0: as before
    std::vector<bool> sounds_;                ///< of the voices: those that the mix has
    std::vector<float> dry_, send_;           ///< of a block
    std::int64_t position_ = 0, loud_ = 0;    ///< loud_: up to the last sample that is not silent
    std::int64_t broken_ = -1;  ///< first block with a sample that is no number, silenced; -1: none
};

}  // namespace audio
