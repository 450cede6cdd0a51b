#include "live_thread.h"

#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "clocks.h"

namespace audio {
namespace {

constexpr std::size_t kQueueLength = 1024;
constexpr std::size_t kNotesAhead = 4096;
constexpr std::size_t kBlocksWaiting = 32768;
constexpr std::int64_t kRingSamples = 1 << 20;        // 22 s; whole blocks of any power of two
constexpr std::int64_t kDeviceRingSamples = 1 << 16;  // 1.4 s
constexpr std::chrono::milliseconds kBetweenHandingsOver{20};
constexpr std::int64_t kLongestSleepNs = 20'000'000;  // of a wait in which finish() must be heard

/// A vector with that capacity, its memory touched so that no later use of it makes a page fault.
template <class T>
std::vector<T> reserved(std::size_t capacity) {
    std::vector<T> values(capacity);
    values.clear();
    return values;
}

/// A JACK client, where one is asked for.
std::unique_ptr<JackOutput> open_jack(const LiveOptions& options) {
    const bool sound = options.output == LiveOptions::Output::jack;
    if (!sound && options.midi_port.empty() && options.midi_input.empty()) return nullptr;
    return std::make_unique<JackOutput>(JackOutput::Options{.sound = sound,
                                                            .midi_port = options.midi_port,
                                                            .midi_connect = options.midi_connect,
                                                            .midi_input = options.midi_input,
                                                            .output_lead_s = options.output_lead_s});
}

LiveOptions checked(const LiveOptions& options) {
    if (options.midi_port.empty() && !options.midi_connect.empty()) {
        throw std::logic_error("live performance: found a MIDI peer without a MIDI port, expected both");
    }
    if (options.output_lead_s >= 0 && options.output_lead_s <= 1 && options.longest_s > 0 &&
        options.longest_s <= 86400) {
        return options;
    }
    throw std::logic_error("live performance: found an output lead of " +
                           std::to_string(options.output_lead_s) + " s and a length of " +
                           std::to_string(options.longest_s) +
                           " s, expected 0 to 1 s and at most a day, more than none");
}

}  // namespace

LiveThread::LiveThread(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                       const LiveOptions& options)
    : options_(checked(options)),
      longest_samples_(static_cast<std::int64_t>(std::ceil(options.longest_s * kSampleRate))),
      commands_(kQueueLength),
      played_(2 * kNotesAhead),
      timings_(kBlocksWaiting),
      ring_(2 * kRingSamples),
      notes_(kNotesAhead),
      taken_(reserved<TakenNote>(kNotesAhead)) {
    if (options.output == LiveOptions::Output::alsa)
        devices_.push_back(std::make_unique<AlsaOutput>(options.alsa_device, options.output_lead_s,
                                                        options.on_thread_start));
    if (std::unique_ptr<JackOutput> jack = open_jack(options)) {
        jack_ = jack.get();
        devices_.push_back(std::move(jack));
    }
    if (options.output != LiveOptions::Output::none) {
        device_ring_.resize(2 * kDeviceRingSamples);
        device_delay_s_ = devices_.front()->delay_s() + static_cast<double>(Limiter::kDelay) / kSampleRate;
    }
    std::future<StartUp> ready = prepared_.get_future();
    thread_ = std::thread([this, orchestra, voices] { run(orchestra, voices); });
    try {
        start_up_ = ready.get();
    } catch (...) {
        thread_.join();
        throw;
    }
    taker_ = std::jthread([this](const std::stop_token& stop) { hand_over(stop); });
}

LiveThread::~LiveThread() {
    set_state(State::stopping);
    thread_.join();
}

void LiveThread::set_state(State state) noexcept {
    state_.store(state, std::memory_order_release);
    state_.notify_one();
}

void LiveThread::start(std::int64_t epoch_ns) {
    if (state() != State::waiting) {
        throw std::logic_error("live performance: found it started already, expected one start");
    }
    epoch_ns_ = epoch_ns;
    set_state(State::running);
}

std::int64_t LiveThread::finish(std::int64_t minimum_samples, std::int64_t tail_samples) {
    if (minimum_samples < 0 || tail_samples < 0 || state() == State::finishing) {
        throw std::logic_error(
            "finish: found a negative number of samples or a second call, expected neither");
    }
    minimum_samples_ = minimum_samples;
    tail_samples_ = tail_samples;
    set_state(State::finishing);
    const std::int64_t kept = kept_samples_.get_future().get();
    taker_ = {};  // hands over what is left
    if (sink_failure_) std::rethrow_exception(sink_failure_);
    return kept;
}

LiveThread::Counts LiveThread::counts() const noexcept {
    return {refused_.load(std::memory_order_relaxed),
            overflows_.load(std::memory_order_relaxed),
            {blocks_done_.load(std::memory_order_relaxed), blocks_late_.load(std::memory_order_relaxed)}};
}

bool LiveThread::send(const LiveCommand& command) noexcept {
    if (failed()) return false;
    if (commands_.try_push(command)) return true;
    overflows_.fetch_add(1, std::memory_order_relaxed);
    return false;
}

void LiveThread::run(const std::filesystem::path& orchestra, const std::vector<Voice>& voices) noexcept {
    try {
        prepare(orchestra, voices);
        prepared_.set_value({renderer_->block_size(), renderer_->version()});
    } catch (...) {
        prepared_.set_exception(std::current_exception());
        renderer_.reset();
        return;
    }
    try {
        perform();
        kept_samples_.set_value(renderer_->kept_samples(minimum_samples_, tail_samples_));
    } catch (...) {
        failed_.store(true, std::memory_order_release);
        play_on_device(false);
        kept_samples_.set_exception(std::current_exception());
    }
    renderer_.reset();  // Csound dies on its own thread
}

void LiveThread::prepare(const std::filesystem::path& orchestra, const std::vector<Voice>& voices) {
    if (options_.on_thread_start) options_.on_thread_start();
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);  // as Performance: decayed modes must not cost
    renderer_.emplace(orchestra, voices, options_.mix);
    if (!renderer_->warm_up()) renderer_.emplace(orchestra, voices, options_.mix);
    if (kRingSamples % renderer_->block_size() != 0)
        throw std::runtime_error("live performance: found blocks of " +
                                 std::to_string(renderer_->block_size()) +
                                 " samples, expected a power of two");
    block_ = reserved<float>(2 * static_cast<std::size_t>(renderer_->block_size()));
    busy_begin_s_ = thread_seconds();
}

void LiveThread::perform() {
    state_.wait(State::waiting, std::memory_order_acquire);
    play_on_device(true);
    perform_in_time();
    play_on_device(false);
    state_.wait(State::running, std::memory_order_acquire);
    if (state() == State::stopping) return;
    const std::int64_t end = minimum_samples_ + tail_samples_;
    fixed_sample_.store(std::max(end, renderer_->position()), std::memory_order_seq_cst);
    read_commands();
    start_notes_before(end);
    while (renderer_->goes_on(minimum_samples_, tail_samples_)) {
        wait_for_room();
        render_block();
    }
    measure_busy();
}

void LiveThread::play_on_device(bool on) noexcept {
    if (on == on_device_) return;
    on_device_ = on;
    for (const std::unique_ptr<SoundDevice>& device : devices_)
        on ? device->start(device_ring_, epoch_ns_) : device->stop();
}

/// The newest block, limited, to where the devices read.
void LiveThread::give_to_device(std::int64_t begin) noexcept {
    if (device_ring_.empty()) return;
    limiter_.limit(block_);
    DeviceRing::write(device_ring_, begin, block_);
    devices_.front()->publish(renderer_->position());
}

void LiveThread::perform_in_time() {
    const std::int64_t lead_ns = std::llround(options_.output_lead_s * 1e9);
    while (state() == State::running && renderer_->position() < longest_samples_) {
        const std::int64_t planned_ns = epoch_ns_ + samples_ns(renderer_->position()) - lead_ns;
        if (wait_until(planned_ns)) play_block(planned_ns);
    }
}

/// False where the performance ends instead. Commands are read in between, for a long wait before the epoch.
bool LiveThread::wait_until(std::int64_t planned_ns) {
    for (std::int64_t now = monotonic_ns(); now < planned_ns; now = monotonic_ns()) {
        sleep_until_ns(std::min(planned_ns, now + kLongestSleepNs));
        if (state() != State::running) return false;
        read_commands();
    }
    return true;
}

void LiveThread::play_block(std::int64_t planned_ns) {
    BlockTiming timing{.planned_ns = planned_ns, .started_ns = monotonic_ns()};
    const std::int64_t begin = renderer_->position();
    const std::int64_t end = begin + renderer_->block_size();
    fixed_sample_.store(end, std::memory_order_seq_cst);  // before the queue is read: see the header
    read_commands();
    start_notes_before(end);
    render_block();
    if (on_device_) give_to_device(begin);
    timing.done_ns = monotonic_ns();
    note_timing(timing, epoch_ns_ + samples_ns(begin));
}

/// Into the ring.
void LiveThread::render_block() {
    const std::int64_t begin = renderer_->position();
    if (begin + renderer_->block_size() - handed_over_.load(std::memory_order_acquire) > kRingSamples)
        throw std::runtime_error("the sound could not be kept: the disk took nothing for 20 s");
    block_.clear();
    renderer_->render_block(block_);
    std::ranges::copy(block_, ring_.begin() + 2 * (begin % kRingSamples));
    rendered_.store(renderer_->position(), std::memory_order_release);
}

/// Not in real time.
void LiveThread::wait_for_room() {
    while (renderer_->position() + renderer_->block_size() - handed_over_.load(std::memory_order_acquire) >
           kRingSamples)
        sleep_until_ns(monotonic_ns() + kLongestSleepNs);
}

/// The taker's thread: gives the sink what was rendered, until it is told to stop and nothing is left.
void LiveThread::hand_over(const std::stop_token& stop) {
    for (;;) {
        const bool last = stop.stop_requested();
        const std::int64_t rendered = rendered_.load(std::memory_order_acquire);
        std::int64_t begin = handed_over_.load(std::memory_order_relaxed);
        while (begin < rendered) {
            const std::int64_t at = begin % kRingSamples,
                               count = std::min(rendered - begin, kRingSamples - at);
            try {
                if (options_.take_sound && !sink_failure_)
                    options_.take_sound(std::span(ring_).subspan(static_cast<std::size_t>(2 * at),
                                                                 static_cast<std::size_t>(2 * count)));
            } catch (...) {
                sink_failure_ = std::current_exception();
                failed_.store(true, std::memory_order_release);
            }
            handed_over_.store(begin += count, std::memory_order_release);
        }
        if (last) return;
        std::this_thread::sleep_for(kBetweenHandingsOver);
    }
}

void LiveThread::note_timing(const BlockTiming& timing, std::int64_t due_ns) noexcept {
    if (!timings_.try_push(timing)) overflows_.fetch_add(1, std::memory_order_relaxed);
    if (timing.done_ns > due_ns) blocks_late_.fetch_add(1, std::memory_order_relaxed);
    blocks_done_.fetch_add(1, std::memory_order_relaxed);
    measure_busy();
}

void LiveThread::read_commands() noexcept {
    LiveCommand command;
    while (commands_.try_pop(command)) obey(command);
}

void LiveThread::obey(const LiveCommand& command) noexcept {
    const LiveNotes::Answer answer = command.kind == LiveCommand::Kind::schedule
                                         ? notes_.put(command.note)
                                         : notes_.cancel(command.note.id);
    if (answer == LiveNotes::Answer::too_late) refused_.fetch_add(1, std::memory_order_relaxed);
    if (answer == LiveNotes::Answer::full) overflows_.fetch_add(1, std::memory_order_relaxed);
}

void LiveThread::start_notes_before(std::int64_t end) {
    notes_.take_before(end, renderer_->position(), taken_);
    const std::int64_t now = taken_.empty() ? 0 : monotonic_ns();
    for (const TakenNote& each : taken_) {
        renderer_->add(each.note);
        answer({.id = each.note.id,
                .planned_sample = each.planned_sample,
                .onset_sample = each.note.onset_sample,
                .taken_ns = now,
                .midi_sent_ns = send_stroke(each.note)});
    }
}

/// When it was handed over; 0: it was not.
std::int64_t LiveThread::send_stroke(const Note& note) noexcept {
    if (!on_device_ || jack_ == nullptr || !jack_->has_midi() || note.kind != Note::Kind::stroke) return 0;
    const MidiStroke stroke{
        .due_ns = epoch_ns_ + samples_ns(note.onset_sample) + std::llround(device_delay_s_ * 1e9),
        .key = static_cast<std::uint8_t>(std::clamp(note.midi_note, 0, 127)),
        .velocity = static_cast<std::uint8_t>(std::clamp(note.midi_velocity, 1, 127))};
    return jack_->send(stroke) ? monotonic_ns() : 0;
}

void LiveThread::answer(const PlayedNote& note) noexcept {
    if (!played_.try_push(note)) overflows_.fetch_add(1, std::memory_order_relaxed);
}

void LiveThread::measure_busy() noexcept {
    busy_s_.store(thread_seconds() - busy_begin_s_, std::memory_order_relaxed);
}

}  // namespace audio
