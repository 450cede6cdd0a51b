#include "audio/performance.h"

#include <xmmintrin.h>

#include <atomic>
#include <exception>
#include <future>
#include <map>
#include <stdexcept>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <variant>

#include "clocks.h"
#include "command_queue.h"
#include "playable.h"
#include "renderer.h"

namespace audio {
namespace {

struct RenderTo {
    std::int64_t sample = 0;
};
struct Finish {
    std::int64_t minimum_samples = 0;
    std::int64_t tail_samples = 0;
};
struct Stop {};
using Command = std::variant<Stop, Note, RenderTo, Finish>;

constexpr std::size_t kQueueLength = 256;

void check_note(const Note& note, std::size_t voices) {
    if (!is_playable(note, voices)) {
        throw std::logic_error("note " + std::to_string(note.id) + ": found voice " +
                               std::to_string(note.voice) + ", onset " + std::to_string(note.onset_sample) +
                               ", speed " + std::to_string(note.speed_mps) + ", place " +
                               std::to_string(note.place) + ", zone " + std::to_string(note.zone) +
                               ", expected a positive id, a voice below " + std::to_string(voices) +
                               ", none negative, place at most 1");
    }
}

/// The notes that may still change, and the line that they must not be changed behind. Caller's thread only.
class PendingNotes {
public:
    void put(const Note& note, std::int64_t reached) {
        if (note.onset_sample < reached || settled_.contains(note.id)) {
            throw std::logic_error("note " + std::to_string(note.id) + " with onset " +
                                   std::to_string(note.onset_sample) + ": found the performance at sample " +
                                   std::to_string(reached) + ", expected onsets and changes ahead of it");
        }
        if (onsets_.contains(note.id)) remove(note.id, reached);
        onsets_[note.id] = note.onset_sample;
        notes_.emplace(std::pair(note.onset_sample, note.id), note);
    }

    void remove(std::uint64_t id, std::int64_t reached) {
        const auto onset = onsets_.find(id);
        if (onset == onsets_.end() || onset->second < reached) {
            throw std::logic_error("note " + std::to_string(id) +
                                   ": found it unknown or already reached by sample " +
                                   std::to_string(reached) + ", expected a note ahead");
        }
        notes_.erase(std::pair(onset->second, id));
        onsets_.erase(onset);
    }

    /// Takes out, in order of onset (then id), the notes before `sample`.
    template <class Receiver>
    void settle_before(std::int64_t sample, Receiver receive) {
        while (!notes_.empty() && notes_.begin()->first.first < sample) {
            const Note note = notes_.begin()->second;
            notes_.erase(notes_.begin());
            onsets_.erase(note.id);
            settled_.insert(note.id);
            receive(note);
        }
    }

private:
    std::map<std::pair<std::int64_t, std::uint64_t>, Note> notes_;
    std::unordered_map<std::uint64_t, std::int64_t> onsets_;
    std::unordered_set<std::uint64_t> settled_;
};

struct StartUp {
    int block_size = 0;
    std::string version;
};

}  // namespace

struct Performance::Implementation {
    Implementation(const std::filesystem::path& orchestra, const std::vector<Voice>& voices, const Mix& mix)
        : voice_count(voices.size()) {
        std::future<StartUp> started = start_up.get_future();
        result = samples.get_future();
        thread = std::thread([this, orchestra, voices, mix] { run(orchestra, voices, mix); });
        try {
            start = started.get();
        } catch (...) {
            thread.join();
            throw;
        }
    }

    ~Implementation() {
        queue.push(Stop{});
        thread.join();
    }

    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    // The audio thread: Csound lives and dies here.
    void run(const std::filesystem::path& orchestra, const std::vector<Voice>& voices, const Mix& mix) {
        _MM_SET_FLUSH_ZERO_MODE(
            _MM_FLUSH_ZERO_ON);  // decayed modes must not cost; this thread's own register
        try {
            Renderer renderer(orchestra, voices, mix);
            start_up.set_value({renderer.block_size(), renderer.version()});
            serve(renderer);
        } catch (...) {
            // serve() throws nothing: only start-up arrives here.
            start_up.set_exception(std::current_exception());
        }
    }

    void serve(Renderer& renderer) noexcept {
        const double begin = thread_seconds();
        for (Command command = queue.pop(); !std::holds_alternative<Stop>(command); command = queue.pop()) {
            try {
                if (!failed.load(std::memory_order_relaxed)) obey(renderer, command);
            } catch (...) {
                failure = std::current_exception();
                failed.store(true, std::memory_order_release);
            }
            busy.store(thread_seconds() - begin, std::memory_order_relaxed);
            if (std::holds_alternative<Finish>(command)) deliver();
        }
    }

    void obey(Renderer& renderer, const Command& command) {
        if (const auto* note = std::get_if<Note>(&command)) renderer.add(*note);
        if (const auto* render = std::get_if<RenderTo>(&command))
            renderer.render_to(render->sample, rendered);
        if (const auto* finish = std::get_if<Finish>(&command)) {
            while (renderer.goes_on(finish->minimum_samples, finish->tail_samples))
                renderer.render_block(rendered);
            renderer.require_numbers();
            rendered.resize(2 * static_cast<std::size_t>(
                                    renderer.kept_samples(finish->minimum_samples, finish->tail_samples)));
        }
    }

    void deliver() {
        if (failed.load(std::memory_order_relaxed)) {
            samples.set_exception(failure);
        } else {
            samples.set_value(std::move(rendered));
        }
    }

    // The caller's thread.
    void check_open() const {
        if (finished) throw std::logic_error("performance: found it finished, expected no further call");
        if (failed.load(std::memory_order_acquire)) std::rethrow_exception(failure);
    }

    void settle_before(std::int64_t sample) {
        pending.settle_before(sample, [this](const Note& note) { queue.push(note); });
    }

    const std::size_t voice_count;
    StartUp start;
    PendingNotes pending;
    std::int64_t reached = 0;   // given to advance_to
    std::int64_t boundary = 0;  // the whole blocks before it
    bool finished = false;
    std::future<std::vector<float>> result;

    // Shared: the queue orders everything, except these.
    CommandQueue<Command> queue{kQueueLength};
    std::promise<StartUp> start_up;
    std::promise<std::vector<float>> samples;
    std::atomic<double> busy{0};
    std::atomic<bool> failed{false};
    std::exception_ptr failure;  // written once, before `failed`

    std::vector<float> rendered;  // audio thread
    std::thread thread;
};

Performance::Performance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                         const Mix& mix)
    : implementation_(std::make_unique<Implementation>(orchestra, voices, mix)) {}

Performance::~Performance() = default;

void Performance::schedule(const Note& note) {
    implementation_->check_open();
    check_note(note, implementation_->voice_count);
    implementation_->pending.put(note, implementation_->reached);
}

void Performance::cancel(std::uint64_t id) {
    implementation_->check_open();
    implementation_->pending.remove(id, implementation_->reached);
}

void Performance::advance_to(std::int64_t sample) {
    Implementation& self = *implementation_;
    self.check_open();
    if (sample <= self.reached) return;
    self.reached = sample;
    const std::int64_t boundary = sample - sample % self.start.block_size;
    if (boundary == self.boundary) return;
    self.boundary = boundary;
    self.settle_before(boundary);
    self.queue.push(RenderTo{boundary});
}

std::vector<float> Performance::finish(std::int64_t minimum_samples, std::int64_t tail_samples) {
    Implementation& self = *implementation_;
    self.check_open();
    if (minimum_samples < 0 || tail_samples < 0) {
        throw std::logic_error("finish: found a negative number of samples, expected none");
    }
    self.finished = true;
    self.settle_before(minimum_samples + tail_samples);
    self.queue.push(Finish{minimum_samples, tail_samples});
    return self.result.get();
}

std::string Performance::version() const {
    return implementation_->start.version;
}

double Performance::busy_s() const {
    return implementation_->busy.load(std::memory_order_relaxed);
}

}  // namespace audio
