#include "renderer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "audio/orchestra.h"

namespace audio {
namespace {

constexpr int kChokeTable = 901;
constexpr int kEndTable = 902;
constexpr float kSilence = 1e-4F;  // -80 dBFS

/// Numbers of the choke groups' names, in order of appearance.
class ChokeGroups {
public:
    explicit ChokeGroups(std::size_t capacity) : capacity_(capacity) {}
    int number(const std::string& name) {
        if (name.empty()) return -1;
        const int next = static_cast<int>(numbers_.size());
        const int found = numbers_.try_emplace(name, next).first->second;
        if (numbers_.size() > capacity_) {
            throw std::runtime_error("choke group `" + name + "`: found more than " +
                                     std::to_string(capacity_) + " groups, expected at most as many");
        }
        return found;
    }

private:
    std::size_t capacity_;
    std::map<std::string, int> numbers_;
};

void check_mix(const Voice& voice) {
    if (!(voice.pan >= 0 && voice.pan <= 1) || !std::isfinite(voice.gain_db) || voice.gain_db > 60) {
        throw std::runtime_error("voice " + voice.name + ": found pan " + std::to_string(voice.pan) +
                                 ", gain " + std::to_string(voice.gain_db) +
                                 " dB, expected pan 0 to 1, gain up to 60 dB");
    }
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

std::vector<RenderedVoice> resolve_voices(CsoundEngine& engine, const std::vector<Instrument>& instruments,
                                          const std::vector<Voice>& voices, std::size_t choke_capacity) {
    ChokeGroups groups(choke_capacity);
    std::vector<RenderedVoice> rendered;
    for (const Voice& voice : voices) {
        check_mix(voice);
        const Instrument& instrument = find_instrument(instruments, voice);
        const PanGains gains = pan_gains(voice.pan, voice.gain_db);
        rendered.push_back({engine.instrument_number(instrument.name), gains.left, gains.right,
                            groups.number(voice.choke_group),
                            resolve_parameters(instrument, voice.parameters, "voice " + voice.name)});
    }
    return rendered;
}

}  // namespace

PanGains pan_gains(double pan, double gain_db) {
    const double gain = std::pow(10.0, gain_db / 20);
    const double angle = pan * std::numbers::pi / 2;
    return {gain * std::cos(angle), gain * std::sin(angle)};
}

Renderer::Renderer(const std::filesystem::path& orchestra, const std::vector<Voice>& voices)
    : Renderer(read_text(orchestra), orchestra.string(), voices) {}

Renderer::Renderer(const std::string& text, const std::string& source, const std::vector<Voice>& voices)
    : engine_(text, source),
      rule_(probe_onset_rule(engine_.block_size())),
      chokes_(engine_.table(kChokeTable)),
      ends_(engine_.table(kEndTable)) {
    voices_ = resolve_voices(engine_, parse_instruments(text, source), voices, chokes_.size());
}

std::string Renderer::version() const {
    return CsoundEngine::version() + ", " + describe(rule_) + ", blocks of " + std::to_string(block_size());
}

void Renderer::render_to(std::int64_t sample) {
    while (position_ < sample) render_block();
}

void Renderer::render_block() {
    start_due_notes();
    for (const double value : engine_.render_block()) output_.push_back(static_cast<float>(value));
    position_ += block_size();
}

void Renderer::start_due_notes() {
    block_notes_.clear();
    while (!due_.empty() && due_.front().onset_sample < position_ + block_size()) {
        block_notes_.push_back(due_.front());
        due_.pop_front();
    }
    mark_chokes(block_notes_);
    for (const Note& note : block_notes_) start(note, block_notes_);
}

void Renderer::mark_chokes(std::span<const Note> notes) {
    for (const Note& note : notes) {
        const int group = voices_[note.voice].choke_group;
        if (group < 0) continue;
        double& latest = chokes_[static_cast<std::size_t>(group)];
        if (latest < static_cast<double>(position_)) latest = static_cast<double>(note.onset_sample);
    }
}

void Renderer::start(const Note& note, std::span<const Note> block_notes) {
    const RenderedVoice& voice = voices_[note.voice];
    const auto chokes_this = [&](const Note& other) {
        return voice.choke_group >= 0 && voices_[other.voice].choke_group == voice.choke_group &&
               other.onset_sample > note.onset_sample;
    };
    const auto choking = std::ranges::find_if(block_notes, chokes_this);
    const double choke = choking == block_notes.end() ? -1 : static_cast<double>(choking->onset_sample);
    const int offset = static_cast<int>(note.onset_sample - position_);
    p_fields_ = {voice.instrument,
                 onset_p2(rule_, offset, block_size()),
                 1,  // the instrument sets its own duration
                 static_cast<double>(note.onset_sample),
                 voice.left,
                 voice.right,
                 note.speed_mps,
                 note.place,
                 static_cast<double>(note.zone),
                 static_cast<double>(voice.choke_group),
                 choke};
    p_fields_.insert(p_fields_.end(), voice.parameters.begin(), voice.parameters.end());
    engine_.start_note(p_fields_);
}

bool Renderer::sounding() const {
    return !due_.empty() || ends_.front() > static_cast<double>(position_);
}

std::vector<float> Renderer::finish(std::int64_t minimum_samples, std::int64_t tail_samples) {
    const std::int64_t limit = minimum_samples + tail_samples;
    while (position_ < minimum_samples || (position_ < limit && sounding())) render_block();
    const auto last_loud = std::find_if(output_.rbegin(), output_.rend(),
                                        [](float value) { return std::abs(value) >= kSilence; });
    const std::int64_t loud_frames = (output_.rend() - last_loud + 1) / 2;
    const std::int64_t frames = std::clamp(loud_frames, minimum_samples, limit);
    output_.resize(static_cast<std::size_t>(2 * frames));
    return std::move(output_);
}

}  // namespace audio
