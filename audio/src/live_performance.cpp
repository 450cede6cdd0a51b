#include "audio/live_performance.h"

#include "live_thread.h"
#include "playable.h"

namespace audio {

struct LivePerformance::Implementation {
    LiveThread thread;
    const std::size_t voice_count;

    [[nodiscard]] DeviceCounts device_counts() const {
        return thread.device() ? thread.device()->counts() : DeviceCounts{};
    }
    /// Those of MIDI, which is JACK's whatever plays the sound.
    [[nodiscard]] DeviceCounts midi_counts() const {
        return thread.jack() ? thread.jack()->counts() : DeviceCounts{};
    }
};

LivePerformance::LivePerformance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                                 const LiveOptions& options)
    : implementation_(new Implementation{{orchestra, voices, options}, voices.size()}) {}

LivePerformance::~LivePerformance() = default;

void LivePerformance::start(std::int64_t epoch_ns) {
    implementation_->thread.start(epoch_ns);
}

bool LivePerformance::schedule(const Note& note) noexcept {
    if (!is_playable(note, implementation_->voice_count)) return false;
    return implementation_->thread.send({LiveCommand::Kind::schedule, note});
}

bool LivePerformance::cancel(std::uint64_t id) noexcept {
    return implementation_->thread.send({LiveCommand::Kind::cancel, {.id = id}});
}

std::int64_t LivePerformance::fixed_sample() const noexcept {
    return implementation_->thread.fixed_sample();
}

bool LivePerformance::failed() const noexcept {
    return implementation_->thread.failed();
}

std::vector<PlayedNote> LivePerformance::take_played() {
    return implementation_->thread.take_played();
}

std::int64_t LivePerformance::finish(std::int64_t minimum_samples, std::int64_t tail_samples) {
    return implementation_->thread.finish(minimum_samples, tail_samples);
}

std::vector<BlockTiming> LivePerformance::take_blocks() {
    return implementation_->thread.take_blocks();
}

int LivePerformance::block_size() const {
    return implementation_->thread.start_up().block_size;
}

BlockCount LivePerformance::block_count() const noexcept {
    return implementation_->thread.counts().blocks;
}

std::uint64_t LivePerformance::refused_changes() const {
    return implementation_->thread.counts().refused;
}

std::uint64_t LivePerformance::queue_overflows() const {
    return implementation_->thread.counts().overflows;
}

std::uint64_t LivePerformance::device_underruns() const {
    return implementation_->device_counts().underruns;
}

std::uint64_t LivePerformance::device_corrections() const {
    return implementation_->device_counts().corrections;
}

std::uint64_t LivePerformance::late_strokes() const {
    return implementation_->midi_counts().late_strokes;
}

std::uint64_t LivePerformance::lost_strokes() const {
    return implementation_->midi_counts().lost_strokes;
}

std::string LivePerformance::midi_problem() const {
    const JackOutput* jack = implementation_->thread.jack();
    return jack != nullptr ? jack->midi_problem() : "";
}

std::string LivePerformance::version() const {
    return implementation_->thread.start_up().version;
}

std::string LivePerformance::device() const {
    const SoundDevice* device = implementation_->thread.device();
    const JackOutput* jack = implementation_->thread.jack();
    if (device == nullptr) return "file only";
    return device->description() + (jack != nullptr && device != jack ? "; " + jack->description() : "");
}

double LivePerformance::device_delay_s() const {
    return implementation_->thread.device_delay_s();
}

std::vector<MidiMessage> LivePerformance::take_midi() {
    std::vector<MidiMessage> messages;
    JackOutput* jack = implementation_->thread.jack();
    const double epoch_s = 1e-9 * static_cast<double>(implementation_->thread.epoch_ns());
    for (MidiMessage message; jack != nullptr && jack->take(message);) {
        message.t_s -= epoch_s;
        messages.push_back(message);
    }
    return messages;
}

double LivePerformance::busy_s() const {
    return implementation_->thread.busy_s();
}

}  // namespace audio
