#include "renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>

#include "audio/orchestra.h"
#include "audio/own_orchestra.h"

namespace audio {
namespace {

constexpr int kChokeTable = 901;
constexpr int kEndTable = 902;
constexpr int kSendTable = 903;
constexpr int kDecayTable = 904;
constexpr int kFirstSampleTable = 10000;
constexpr const char* kSampleInstrument = "sample";
constexpr float kSilence = 1e-4F;                                 // -80 dBFS
constexpr std::size_t kRoomForNotes = 4096, kRoomForFields = 64;  // taken ahead; more is allowed
// Warm-up: so many notes of each voice at once find their memory in place later; choked notes are over within
// 15 ms and two blocks, here 21 ms at 64 samples.
constexpr int kWarmCopies = 3;
constexpr int kWarmBlocks = 16;

/// Numbers of the choke groups' names, in order of appearance; -1: none.
class ChokeGroups {
public:
    int number(const std::string& name) {
        if (name.empty()) return -1;
        return numbers_.try_emplace(name, static_cast<int>(numbers_.size())).first->second;
    }

private:
    std::map<std::string, int> numbers_;
};

void check_mix(const Voice& voice) {
    if (!(voice.pan >= 0 && voice.pan <= 1) || !std::isfinite(voice.gain_db) || voice.gain_db > 60) {
        throw std::runtime_error("voice " + voice.name + ": found pan " + std::to_string(voice.pan) +
                                 ", gain " + std::to_string(voice.gain_db) +
                                 " dB, expected pan 0 to 1, gain up to 60 dB");
    }
    if (!(std::abs(voice.balance) <= 1) || !std::isfinite(voice.room_send_db) || voice.room_send_db > 60) {
        throw std::runtime_error("voice " + voice.name + ": found balance " + std::to_string(voice.balance) +
                                 ", room send " + std::to_string(voice.room_send_db) +
                                 " dB, expected balance -1 to 1, send up to 60 dB");
    }
}

const Mix& checked(const Mix& mix) {
    const double t60_s = mix.room.t60_s, level_db = mix.room.level_db;
    if (std::abs(mix.gain_db) <= 160 && t60_s >= 0 && t60_s <= 20 && std::abs(level_db) <= 60) return mix;
    throw std::runtime_error("mix: found gain " + std::to_string(mix.gain_db) + " dB, room of " +
                             std::to_string(t60_s) + " s at " + std::to_string(level_db) +
                             " dB, expected -160 to 160 dB, 0 to 20 s, -60 to 60 dB");
}

const Instrument& find_instrument(const std::vector<Instrument>& instruments, const Voice& voice) {
    const auto found = std::ranges::find(instruments, voice.instrument, &Instrument::name);
    if (found != instruments.end()) return *found;
    std::string known;
    for (const Instrument& instrument : instruments) {
        if (!known.empty()) known += ", ";
        known += instrument.name;
    }
    throw std::runtime_error("voice " + voice.name + ": found instrument `" + voice.instrument +
                             "`, expected one of: " + known);
}

/// The names that instruments of one's own may not have.
std::vector<std::string> taken_names(const std::vector<Instrument>& bundled) {
    std::vector<std::string> taken = {kSampleInstrument};
    for (const Instrument& instrument : bundled) taken.push_back(instrument.name);
    return taken;
}

/// The orchestra with what its voices need behind it: the instrument of recorded sounds, orchestras of one's own.
std::string with_own_sounds(const std::filesystem::path& orchestra, const std::vector<Voice>& voices) {
    std::string text = read_text(orchestra);
    const auto sampled = [](const Voice& voice) { return voice.samples != nullptr; };
    if (std::ranges::any_of(voices, sampled))
        text += "\n" + read_text(orchestra.parent_path() / "samples.orc");
    const std::vector<std::string> taken = taken_names(parse_instruments(text, orchestra.string()));
    std::set<std::filesystem::path> own;
    for (const Voice& voice : voices) {
        if (voice.own_orchestra.empty() || !own.insert(voice.own_orchestra).second) continue;
        text += "\n" + read_own_orchestra(voice.own_orchestra, taken);
    }
    return text;
}

std::vector<RenderedVoice> resolve_voices(CsoundEngine& engine, const std::vector<Instrument>& instruments,
                                          const std::vector<Voice>& voices) {
    ChokeGroups groups;
    SampleTables tables(kFirstSampleTable);
    std::vector<RenderedVoice> rendered;
    for (const Voice& voice : voices) {
        check_mix(voice);
        const PanGains gains = pan_gains(voice.pan, voice.gain_db);
        RenderedVoice& made = rendered.emplace_back();
        made.left = gains.left * std::min(1.0, 1 - voice.balance);
        made.right = gains.right * std::min(1.0, 1 + voice.balance);
        made.choke_group = groups.number(voice.choke_group);
        if (voice.samples) {
            made.instrument = engine.instrument_number(kSampleInstrument);
            made.samples.emplace(engine, voice.samples, tables);
            if (voice.pedal_parameters.empty()) continue;
        }
        const Instrument& instrument = find_instrument(instruments, voice);
        if (!voice.samples) made.instrument = engine.instrument_number(instrument.name);
        made.parameters = resolve_parameters(instrument, voice.parameters, "voice " + voice.name);
        if (voice.pedal_parameters.empty()) continue;
        std::vector<std::pair<std::string, double>> pressed = voice.pedal_parameters;
        for (const auto& own : voice.parameters)
            if (std::ranges::find(pressed, own.first, &std::pair<std::string, double>::first) ==
                pressed.end())
                pressed.push_back(own);
        made.pedal_parameters = resolve_parameters(instrument, pressed, "voice " + voice.name + ", pedal");
        const auto decay = std::ranges::find(instrument.parameters, "decay_s", &Parameter::name);
        if (decay != instrument.parameters.end())
            made.decay = static_cast<std::size_t>(decay - instrument.parameters.begin());
    }
    return rendered;
}

/// A parameter on its pedal's way, from its value at rest to that at the far end.
double on_the_way(double rest, double far, double place) {
    if (place == 0) return rest;
    return rest * far > 0 ? rest * std::pow(far / rest, place) : std::lerp(rest, far, place);
}

}  // namespace

PanGains pan_gains(double pan, double gain_db) {
    const double gain = std::pow(10.0, gain_db / 20);
    const double angle = pan * std::numbers::pi / 2;
    return {gain * std::cos(angle), gain * std::sin(angle)};
}

Renderer::Renderer(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                   const Mix& mix) try
    : Renderer(with_own_sounds(orchestra, voices), orchestra.string(), voices, mix) {
} catch (const SampleError&) {
    throw;
} catch (const std::runtime_error&) {
    for (const Voice& voice : voices)  // Csound names the bundled orchestra, whichever it stopped at
        if (!voice.own_orchestra.empty()) check_own_orchestra(orchestra, voice.own_orchestra);
    throw;
}

void check_own_orchestra(const std::filesystem::path& orchestra, const std::filesystem::path& own) {
    const std::string text = read_text(orchestra);
    const std::vector<std::string> taken = taken_names(parse_instruments(text, orchestra.string()));
    compile_own_orchestra(text, read_own_orchestra(own, taken), own.string());
}

Renderer::Renderer(const std::string& text, const std::string& source, const std::vector<Voice>& voices,
                   const Mix& mix)
    : engine_(text, source),
      rule_(probe_onset_rule(engine_.block_size())),
      mix_(checked(mix)),
      room_(mix.alone.empty() ? mix.room : RoomSound{}, static_cast<std::size_t>(engine_.block_size())),
      chokes_(engine_.table(kChokeTable)),
      ends_(engine_.table(kEndTable)) {
    due_.reserve(kRoomForNotes);
    p_fields_.reserve(kRoomForFields);
    if (voices.size() > chokes_.size())
        throw std::runtime_error("voices: found " + std::to_string(voices.size()) + ", expected at most " +
                                 std::to_string(chokes_.size()));
    voices_ = resolve_voices(engine_, parse_instruments(text, source), voices);
    pressed_.reserve(kRoomForFields);
    coming_.assign(voices.size(), -1);
    for (std::uint32_t voice = 0; voice < voices_.size(); ++voice) {
        const RenderedVoice& made = voices_[voice];
        if (!made.decay) continue;
        decays_ = engine_.table(kDecayTable);
        decays_[2 * voice + 1] = std::max(made.parameters[*made.decay], made.pedal_parameters[*made.decay]);
        set_pedal(voice, 0);
    }
    sounds_.assign(voices.size(), mix.alone.empty());
    for (const std::uint32_t voice : mix.alone) sounds_.at(voice) = true;
    dry_.resize(2 * static_cast<std::size_t>(block_size()));
    send_.resize(engine_.channels() > 2 ? dry_.size() : 0);
    if (!send_.empty()) {
        const std::span<double> sends = engine_.table(kSendTable);
        for (std::size_t i = 0; i < voices.size(); ++i)
            sends[i] = (voices[i].room_send_db <= -60 ? 0 : std::pow(10.0, voices[i].room_send_db / 20)) - 1;
    }
    for (RenderedVoice& voice : voices_) {
        const double gain = std::pow(10.0, mix_.gain_db / 20);
        voice.left *= gain, voice.right *= gain;
    }
    (void)engine_.render_block();  // onset_p2 may name a time in the block before, which Csound must have
}

std::string Renderer::version() const {
    return CsoundEngine::version() + ", " + describe(rule_) + ", blocks of " + std::to_string(block_size());
}

bool Renderer::warm_up() {
    std::vector<Note> notes;
    for (int copy = 0; copy < kWarmCopies; ++copy) {
        for (std::uint32_t voice = 0; voice < voices_.size(); ++voice)
            notes.push_back({.id = 1, .voice = voice});
    }
    for (const Note& note : notes) {
        const RenderedVoice& voice = voices_[note.voice];
        const auto fields =
            voice.samples ? std::span<const double>(voice.samples->first()) : voice.parameters;
        start_event(note, 1, {voice.left, voice.right}, fields);
    }
    bool silent = false;
    for (int block = 0; block < kWarmBlocks; ++block) {
        const std::span<const double> frames = engine_.render_block();
        silent = std::ranges::all_of(frames, [](double value) { return value == 0; });
    }
    ends_.front() = 0;
    return silent;
}

void Renderer::render_to(std::int64_t sample, std::vector<float>& output) {
    while (position_ < sample) render_block(output);
}

void Renderer::render_block(std::vector<float>& output) {
    start_due_notes();
    const std::size_t begin = output.size();
    const std::span<const double> frames = engine_.render_block();
    const std::size_t channels = engine_.channels();
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double value = frames[i];
        if (!std::isfinite(value) && broken_ < 0) broken_ = position_;
        const float sample = std::isfinite(value) ? static_cast<float>(value) : 0.0F;
        const std::size_t frame = i / channels, channel = i % channels;
        (channel < 2 ? dry_[2 * frame + channel] : send_[2 * frame + channel - 2]) = sample;
    }
    for (std::size_t i = 0; i < send_.size(); ++i) send_[i] += dry_[i];
    output.insert(output.end(), dry_.begin(), dry_.end());
    const std::span<float> block = std::span(output).subspan(begin);
    room_.add_answer(send_.empty() ? dry_ : send_, block);
    for (std::size_t i = 0; i < block.size(); ++i)
        if (std::abs(block[i]) >= kSilence) loud_ = position_ + static_cast<std::int64_t>(i / 2 + 1);
    position_ += block_size();
}

void Renderer::require_numbers() const {
    if (broken_ < 0) return;
    throw std::runtime_error(
        "the orchestra: found samples that are no numbers from sample " + std::to_string(broken_) +
        " on, expected finite ones; look for a division by 0 or the root of a negative number "
        "in an instrument of your own");
}

void Renderer::start_due_notes() {
    const std::size_t first = next_due_;
    while (next_due_ < due_.size() && due_[next_due_].onset_sample < position_ + block_size()) ++next_due_;
    const std::span<const Note> notes = std::span(due_).subspan(first, next_due_ - first);
    mark_pedals(notes);
    mark_chokes(notes);
    for (const Note& note : notes) start(note, notes);
    if (next_due_ < due_.size()) return;
    due_.clear();
    next_due_ = 0;
}

bool Renderer::chokes(const Note& note, std::uint32_t voice) const {
    if (note.kind != Note::Kind::stroke) return note.kind == Note::Kind::choke && note.voice == voice;
    const int group = voices_[note.voice].choke_group;
    return group >= 0 && voices_[voice].choke_group == group;
}

void Renderer::set_pedal(std::uint32_t voice, double place) {
    const RenderedVoice& moved = voices_[voice];
    if (moved.decay)
        decays_[2 * voice] =
            on_the_way(moved.parameters[*moved.decay], moved.pedal_parameters[*moved.decay], place);
}

void Renderer::mark_pedals(std::span<const Note> notes) {
    for (std::uint32_t voice = 0; voice < voices_.size(); ++voice)
        if (const double place = std::exchange(coming_[voice], -1); place >= 0) set_pedal(voice, place);
    for (const Note& note : notes) {
        if (note.kind == Note::Kind::choke) continue;
        if (note.kind == Note::Kind::stroke || note.onset_sample <= position_)
            set_pedal(note.voice, note.pedal);
        else
            coming_[note.voice] = note.pedal;
    }
}

void Renderer::mark_chokes(std::span<const Note> notes) {
    for (const Note& note : notes)
        for (std::uint32_t voice = 0; voice < voices_.size(); ++voice)
            if (double& latest = chokes_[voice];
                chokes(note, voice) && latest < static_cast<double>(position_))
                latest = static_cast<double>(note.onset_sample);
}

void Renderer::start(const Note& note, std::span<const Note> block_notes) {
    if (note.kind != Note::Kind::stroke) return;
    if (!sounds_[note.voice] || mix_.alone_note.value_or(note.id) != note.id) {
        if (std::optional<SampleVoice>& samples = voices_[note.voice].samples) (void)samples->strike(note);
        return;
    }
    const auto choking = std::ranges::find_if(block_notes, [&](const Note& other) {
        return other.onset_sample > note.onset_sample && chokes(other, note.voice);
    });
    start_choked(note, choking == block_notes.end() ? -1 : choking->onset_sample);
}

std::span<const double> Renderer::parameters_of(const Note& note) {
    const RenderedVoice& voice = voices_[note.voice];
    if (note.pedal == 0 || voice.pedal_parameters.empty()) return voice.parameters;
    pressed_.clear();
    for (std::size_t i = 0; i < voice.parameters.size(); ++i)
        pressed_.push_back(on_the_way(voice.parameters[i], voice.pedal_parameters[i], note.pedal));
    return pressed_;
}

void Renderer::start_choked(const Note& note, std::int64_t choke_sample) {
    RenderedVoice& voice = voices_[note.voice];
    if (!voice.samples) {
        start_event(note, choke_sample, {voice.left, voice.right}, parameters_of(note));
        return;
    }
    for (const SampleVoice::Event& event : voice.samples->strike(note)) {
        start_event(note, choke_sample, {voice.left * event.left, voice.right * event.right}, event.fields);
    }
}

void Renderer::start_event(const Note& note, std::int64_t choke_sample, PanGains gains,
                           std::span<const double> parameters) {
    const RenderedVoice& voice = voices_[note.voice];
    const int offset = static_cast<int>(note.onset_sample - position_);
    p_fields_ = {voice.instrument,
                 onset_p2(rule_, offset, block_size()),
                 1,  // the instrument sets its own duration
                 static_cast<double>(note.onset_sample),
                 gains.left,
                 gains.right,
                 note.speed_mps,
                 note.place,
                 static_cast<double>(note.zone),
                 static_cast<double>(note.voice),
                 static_cast<double>(choke_sample)};
    p_fields_.insert(p_fields_.end(), parameters.begin(), parameters.end());
    engine_.start_note(p_fields_);
}

bool Renderer::sounding() const {
    return next_due_ < due_.size() ||
           ends_.front() + static_cast<double>(room_.tail_samples()) > static_cast<double>(position_);
}

bool Renderer::goes_on(std::int64_t minimum_samples, std::int64_t tail_samples) const {
    return position_ < minimum_samples || (position_ < minimum_samples + tail_samples && sounding());
}

std::int64_t Renderer::kept_samples(std::int64_t minimum_samples, std::int64_t tail_samples) const {
    return std::clamp(loud_, minimum_samples, minimum_samples + tail_samples);
}

}  // namespace audio
