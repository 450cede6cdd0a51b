#include "audio/live_performance.h"

#include <xmmintrin.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>

#include "clocks.h"
#include "command_queue.h"
#include "jack_output.h"
#include "live_notes.h"
#include "playable.h"
#include "renderer.h"

namespace audio {
namespace {

constexpr std::size_t kQueueLength = 1024;
constexpr std::size_t kNotesAhead = 4096;
constexpr double kNotesPerSecond = 1000;
constexpr std::int64_t kLongestSleepNs = 20'000'000;  // of a wait in which finish() must be heard

/// What the caller asks of the audio thread. A cancel is a note of which only the id matters.
struct Command {
    enum class Kind : std::uint8_t { schedule, cancel } kind = Kind::schedule;
    Note note;
};

enum class State : int { waiting, running, finishing, stopping };

struct StartUp {
    int block_size = 0;
    std::string version;
};

/// A vector with that capacity, its memory touched so that no later use of it makes a page fault.
template <class T>
std::vector<T> reserved(std::size_t capacity) {
    std::vector<T> values(capacity);
    values.clear();
    return values;
}

/// Answers in order, written by one thread and read by another while it grows; room is taken at construction.
class PlayedLog {
public:
    explicit PlayedLog(std::size_t capacity) : notes_(capacity) {}

    [[nodiscard]] bool try_add(const PlayedNote& note) noexcept {
        const std::size_t count = count_.load(std::memory_order_relaxed);
        if (count == notes_.size()) return false;
        notes_[count] = note;
        count_.store(count + 1, std::memory_order_release);
        return true;
    }

    [[nodiscard]] std::vector<PlayedNote> take() {
        const std::size_t count = count_.load(std::memory_order_acquire);
        const std::span<const PlayedNote> fresh = std::span(notes_).subspan(read_, count - read_);
        read_ = count;
        return {fresh.begin(), fresh.end()};
    }

private:
    std::vector<PlayedNote> notes_;
    std::atomic<std::size_t> count_{0};
    std::size_t read_ = 0;  // reading thread
};

/// A JACK client, where one is asked for.
std::unique_ptr<JackOutput> open_jack(const LiveOptions& options) {
    if (!options.jack_audio && options.midi_port.empty()) return nullptr;
    return std::make_unique<JackOutput>(JackOutput::Options{.sound = options.jack_audio,
                                                            .midi_port = options.midi_port,
                                                            .midi_connect = options.midi_connect,
                                                            .output_lead_s = options.output_lead_s});
}

void check_options(const LiveOptions& options) {
    if (options.midi_port.empty() && !options.midi_connect.empty()) {
        throw std::logic_error("live performance: found a MIDI peer without a MIDI port, expected both");
    }
    if (options.output_lead_s >= 0 && options.output_lead_s <= 1 && options.longest_s > 0 &&
        options.longest_s <= 86400) {
        return;
    }
    throw std::logic_error("live performance: found an output lead of " +
                           std::to_string(options.output_lead_s) + " s and a length of " +
                           std::to_string(options.longest_s) +
                           " s, expected 0 to 1 s and at most a day, more than none");
}

}  // namespace

struct LivePerformance::Implementation {
    Implementation(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                   const LiveOptions& live_options);
    ~Implementation();
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    // The caller's thread.
    bool send(const Command& command) noexcept;

    // The audio thread.
    void run(const std::filesystem::path& orchestra, const std::vector<Voice>& voices) noexcept;
    void prepare(const std::filesystem::path& orchestra, const std::vector<Voice>& voices);
    void perform();
    void play_on_device(bool on) noexcept;
    void perform_in_time();
    [[nodiscard]] bool wait_until(std::int64_t planned_ns);
    void play_block(std::int64_t planned_ns);
    void read_commands() noexcept;
    void obey(const Command& command) noexcept;
    void start_notes_before(std::int64_t end);
    [[nodiscard]] std::int64_t send_stroke(const Note& note) noexcept;
    void answer(const TakenNote& taken, std::int64_t taken_ns, std::int64_t midi_sent_ns) noexcept;
    [[nodiscard]] State state_now() const { return state.load(std::memory_order_acquire); }
    [[nodiscard]] std::int64_t longest_samples() const {
        return static_cast<std::int64_t>(std::ceil(options.longest_s * kSampleRate));
    }

    const LiveOptions options;
    const std::size_t voice_count;
    StartUp start_up;

    // Shared.
    CommandQueue<Command> commands{kQueueLength};
    PlayedLog played;
    std::atomic<State> state{State::waiting};
    std::int64_t epoch_ns = 0;                           // written before `running`
    std::int64_t minimum_samples = 0, tail_samples = 0;  // written before `finishing`
    std::atomic<std::int64_t> fixed_sample{0};
    std::atomic<bool> failed{false};
    std::atomic<std::uint64_t> overflows{0}, refused{0}, blocks_done{0}, blocks_late{0};
    std::atomic<double> busy{0};
    std::promise<StartUp> prepared;
    std::promise<std::vector<float>> recording;

    // The audio thread's; the caller's after finish().
    std::optional<Renderer> renderer;
    LiveNotes notes{kNotesAhead};
    std::vector<TakenNote> taken = reserved<TakenNote>(kNotesAhead);
    std::vector<float> output;
    std::vector<BlockTiming> timings;
    std::unique_ptr<JackOutput> jack;  // after `output`, which it reads
    bool on_device = false;            // from start to stop
    double busy_begin = 0;

    std::thread thread;
};

LivePerformance::Implementation::Implementation(const std::filesystem::path& orchestra,
                                                const std::vector<Voice>& voices,
                                                const LiveOptions& live_options)
    : options(live_options),
      voice_count(voices.size()),
      played(2 * kNotesAhead + static_cast<std::size_t>(kNotesPerSecond * live_options.longest_s)),
      jack(open_jack(live_options)) {
    std::future<StartUp> ready = prepared.get_future();
    thread = std::thread([this, orchestra, voices] { run(orchestra, voices); });
    try {
        start_up = ready.get();
    } catch (...) {
        thread.join();
        throw;
    }
}

LivePerformance::Implementation::~Implementation() {
    state.store(State::stopping, std::memory_order_release);
    state.notify_one();
    thread.join();
}

bool LivePerformance::Implementation::send(const Command& command) noexcept {
    if (failed.load(std::memory_order_acquire)) return false;
    if (commands.try_push(command)) return true;
    overflows.fetch_add(1, std::memory_order_relaxed);
    return false;
}

void LivePerformance::Implementation::run(const std::filesystem::path& orchestra,
                                          const std::vector<Voice>& voices) noexcept {
    try {
        prepare(orchestra, voices);
        prepared.set_value({renderer->block_size(), renderer->version()});
    } catch (...) {
        prepared.set_exception(std::current_exception());
        renderer.reset();
        return;
    }
    try {
        perform();
        recording.set_value(std::move(output));
    } catch (...) {
        failed.store(true, std::memory_order_release);
        play_on_device(false);
        recording.set_exception(std::current_exception());
    }
    renderer.reset();  // Csound dies on its own thread
}

void LivePerformance::Implementation::prepare(const std::filesystem::path& orchestra,
                                              const std::vector<Voice>& voices) {
    if (options.on_thread_start) options.on_thread_start();
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);  // as Performance: decayed modes must not cost
    renderer.emplace(orchestra, voices);
    if (!renderer->warm_up()) renderer.emplace(orchestra, voices);
    const auto block = static_cast<std::size_t>(renderer->block_size());
    const auto blocks = static_cast<std::size_t>(longest_samples()) / block + 1;
    output = reserved<float>(2 * block * blocks);
    timings = reserved<BlockTiming>(blocks);
    busy_begin = thread_seconds();
}

void LivePerformance::Implementation::perform() {
    state.wait(State::waiting, std::memory_order_acquire);
    play_on_device(true);
    perform_in_time();
    play_on_device(false);
    state.wait(State::running, std::memory_order_acquire);
    if (state_now() == State::stopping) return;
    const std::int64_t end = minimum_samples + tail_samples;
    fixed_sample.store(std::max(end, renderer->position()), std::memory_order_seq_cst);
    read_commands();
    start_notes_before(end);
    renderer->finish(output, minimum_samples, tail_samples);
    busy.store(thread_seconds() - busy_begin, std::memory_order_relaxed);
}

void LivePerformance::Implementation::play_on_device(bool on) noexcept {
    if (!jack || on == on_device) return;
    on_device = on;
    if (on) {
        jack->start(output.data(), epoch_ns);
    } else {
        jack->stop();
    }
}

void LivePerformance::Implementation::perform_in_time() {
    const std::int64_t lead_ns = std::llround(options.output_lead_s * 1e9);
    while (state_now() == State::running && renderer->position() < longest_samples()) {
        const std::int64_t planned_ns = epoch_ns + samples_ns(renderer->position()) - lead_ns;
        if (wait_until(planned_ns)) play_block(planned_ns);
    }
}

/// False where the performance ends instead. Commands are read in between, for a long wait before the epoch.
bool LivePerformance::Implementation::wait_until(std::int64_t planned_ns) {
    for (std::int64_t now = monotonic_ns(); now < planned_ns; now = monotonic_ns()) {
        sleep_until_ns(std::min(planned_ns, now + kLongestSleepNs));
        if (state_now() != State::running) return false;
        read_commands();
    }
    return true;
}

void LivePerformance::Implementation::play_block(std::int64_t planned_ns) {
    BlockTiming timing{.planned_ns = planned_ns, .started_ns = monotonic_ns()};
    const std::int64_t end = renderer->position() + renderer->block_size();
    fixed_sample.store(end, std::memory_order_seq_cst);  // before the queue is read: see the header
    read_commands();
    start_notes_before(end);
    renderer->render_block(output);
    if (on_device) jack->publish(renderer->position());
    timing.done_ns = monotonic_ns();
    timings.push_back(timing);
    const std::int64_t due_ns = epoch_ns + samples_ns(end - renderer->block_size());
    if (timing.done_ns > due_ns) blocks_late.fetch_add(1, std::memory_order_relaxed);
    blocks_done.fetch_add(1, std::memory_order_relaxed);
    busy.store(thread_seconds() - busy_begin, std::memory_order_relaxed);
}

void LivePerformance::Implementation::read_commands() noexcept {
    Command command;
    while (commands.try_pop(command)) obey(command);
}

void LivePerformance::Implementation::obey(const Command& command) noexcept {
    const LiveNotes::Answer answer =
        command.kind == Command::Kind::schedule ? notes.put(command.note) : notes.cancel(command.note.id);
    if (answer == LiveNotes::Answer::too_late) refused.fetch_add(1, std::memory_order_relaxed);
    if (answer == LiveNotes::Answer::full) overflows.fetch_add(1, std::memory_order_relaxed);
}

void LivePerformance::Implementation::start_notes_before(std::int64_t end) {
    notes.take_before(end, renderer->position(), taken);
    const std::int64_t now = taken.empty() ? 0 : monotonic_ns();
    for (const TakenNote& each : taken) {
        renderer->add(each.note);
        answer(each, now, send_stroke(each.note));
    }
}

/// When it was handed over; 0: it was not.
std::int64_t LivePerformance::Implementation::send_stroke(const Note& note) noexcept {
    if (!on_device || !jack->has_midi()) return 0;
    const MidiStroke stroke{.due_ns = epoch_ns + samples_ns(note.onset_sample),
                            .key = static_cast<std::uint8_t>(std::clamp(note.midi_note, 0, 127)),
                            .velocity = static_cast<std::uint8_t>(std::clamp(note.midi_velocity, 1, 127))};
    return jack->send(stroke) ? monotonic_ns() : 0;
}

void LivePerformance::Implementation::answer(const TakenNote& each, std::int64_t taken_ns,
                                             std::int64_t midi_sent_ns) noexcept {
    const PlayedNote note{.id = each.note.id,
                          .planned_sample = each.planned_sample,
                          .onset_sample = each.note.onset_sample,
                          .taken_ns = taken_ns,
                          .midi_sent_ns = midi_sent_ns};
    if (!played.try_add(note)) overflows.fetch_add(1, std::memory_order_relaxed);
}

LivePerformance::LivePerformance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                                 const LiveOptions& options) {
    check_options(options);
    implementation_ = std::make_unique<Implementation>(orchestra, voices, options);
}

LivePerformance::~LivePerformance() = default;

void LivePerformance::start(std::int64_t epoch_ns) {
    Implementation& self = *implementation_;
    if (self.state_now() != State::waiting) {
        throw std::logic_error("live performance: found it started already, expected one start");
    }
    self.epoch_ns = epoch_ns;
    self.state.store(State::running, std::memory_order_release);
    self.state.notify_one();
}

bool LivePerformance::schedule(const Note& note) noexcept {
    if (!is_playable(note, implementation_->voice_count)) return false;
    return implementation_->send({Command::Kind::schedule, note});
}

bool LivePerformance::cancel(std::uint64_t id) noexcept {
    return implementation_->send({Command::Kind::cancel, {.id = id}});
}

std::int64_t LivePerformance::fixed_sample() const noexcept {
    return implementation_->fixed_sample.load(std::memory_order_seq_cst);
}

bool LivePerformance::failed() const noexcept {
    return implementation_->failed.load(std::memory_order_acquire);
}

std::vector<PlayedNote> LivePerformance::take_played() {
    return implementation_->played.take();
}

std::vector<float> LivePerformance::finish(std::int64_t minimum_samples, std::int64_t tail_samples) {
    Implementation& self = *implementation_;
    if (minimum_samples < 0 || tail_samples < 0 || self.state_now() == State::finishing) {
        throw std::logic_error(
            "finish: found a negative number of samples or a second call, expected neither");
    }
    self.minimum_samples = minimum_samples;
    self.tail_samples = tail_samples;
    self.state.store(State::finishing, std::memory_order_release);
    self.state.notify_one();
    return self.recording.get_future().get();
}

std::span<const BlockTiming> LivePerformance::blocks() const {
    return implementation_->timings;
}

int LivePerformance::block_size() const {
    return implementation_->start_up.block_size;
}

std::uint64_t LivePerformance::refused_changes() const {
    return implementation_->refused.load(std::memory_order_relaxed);
}

std::uint64_t LivePerformance::queue_overflows() const {
    return implementation_->overflows.load(std::memory_order_relaxed);
}

std::uint64_t LivePerformance::device_underruns() const {
    return implementation_->jack ? implementation_->jack->counts().underruns : 0;
}

std::uint64_t LivePerformance::device_corrections() const {
    return implementation_->jack ? implementation_->jack->counts().corrections : 0;
}

BlockCount LivePerformance::block_count() const noexcept {
    return {implementation_->blocks_done.load(std::memory_order_relaxed),
            implementation_->blocks_late.load(std::memory_order_relaxed)};
}

std::uint64_t LivePerformance::late_strokes() const {
    return implementation_->jack ? implementation_->jack->counts().late_strokes : 0;
}

std::string LivePerformance::version() const {
    return implementation_->start_up.version;
}

std::string LivePerformance::device() const {
    return implementation_->jack ? implementation_->jack->description() : "file only";
}

double LivePerformance::busy_s() const {
    return implementation_->busy.load(std::memory_order_relaxed);
}

}  // namespace audio
