#pragma once
#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "alsa_output.h"
#include "audio/live_performance.h"
#include "command_queue.h"
#include "jack_output.h"
#include "limiter.h"
#include "live_notes.h"
#include "renderer.h"

namespace audio {

/// What the caller asks of the audio thread. Of a cancelled note only the id matters.
struct LiveCommand {
    enum class Kind : std::uint8_t { schedule, cancel } kind = Kind::schedule;
    Note note;
};

/// The audio thread of a LivePerformance, which documents what it does: Csound lives and dies on it. A block
/// at a time it publishes which notes are fixed, reads the commands, takes the notes that are due, and
/// renders them into a ring, from which a thread of their own takes the samples.
class LiveThread {
public:
    enum class State : int { waiting, running, finishing, stopping };

    struct StartUp {
        int block_size = 0;
        std::string version;
    };

    struct Counts {
        std::uint64_t refused = 0, overflows = 0;
        BlockCount blocks;
    };

    /// Returns when all is prepared; throws what went wrong meanwhile.
    LiveThread(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
               const LiveOptions& options);
    ~LiveThread();
    LiveThread(const LiveThread&) = delete;
    LiveThread& operator=(const LiveThread&) = delete;

    // The caller's thread.
    void start(std::int64_t epoch_ns);
    bool send(const LiveCommand& command) noexcept;
    [[nodiscard]] std::vector<PlayedNote> take_played() { return taken_from(played_); }
    [[nodiscard]] std::vector<BlockTiming> take_blocks() { return taken_from(timings_); }
    [[nodiscard]] std::int64_t finish(std::int64_t minimum_samples, std::int64_t tail_samples);
    [[nodiscard]] const StartUp& start_up() const { return start_up_; }
    [[nodiscard]] const SoundDevice* device() const {
        return devices_.empty() ? nullptr : devices_.front().get();
    }
    [[nodiscard]] JackOutput* jack() const { return jack_; }  ///< null: none
    [[nodiscard]] double device_delay_s() const { return device_delay_s_; }
    [[nodiscard]] std::int64_t epoch_ns() const { return epoch_ns_; }

    // Any thread.
    [[nodiscard]] State state() const noexcept { return state_.load(std::memory_order_acquire); }
    [[nodiscard]] std::int64_t fixed_sample() const noexcept {
        return fixed_sample_.load(std::memory_order_seq_cst);
    }
    [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }
    [[nodiscard]] double busy_s() const noexcept { return busy_s_.load(std::memory_order_relaxed); }
    [[nodiscard]] Counts counts() const noexcept;

private:
    template <class T>
    static std::vector<T> taken_from(CommandQueue<T>& queue) {
        std::vector<T> all;
        for (T each; queue.try_pop(each);) all.push_back(each);
        return all;
    }
    void run(const std::filesystem::path& orchestra, const std::vector<Voice>& voices) noexcept;
    void prepare(const std::filesystem::path& orchestra, const std::vector<Voice>& voices);
    void perform();
    void play_on_device(bool on) noexcept;
    void give_to_device(std::int64_t begin) noexcept;
    void perform_in_time();
    [[nodiscard]] bool wait_until(std::int64_t planned_ns);
    void play_block(std::int64_t planned_ns);
    void render_block();
    void wait_for_room();
    void hand_over(const std::stop_token& stop);
    void read_commands() noexcept;
    void obey(const LiveCommand& command) noexcept;
    void start_notes_before(std::int64_t end);
    [[nodiscard]] std::int64_t send_stroke(const Note& note) noexcept;
    void answer(const PlayedNote& note) noexcept;
    void note_timing(const BlockTiming& timing, std::int64_t due_ns) noexcept;
    void measure_busy() noexcept;
    void set_state(State state) noexcept;

    const LiveOptions options_;
    const std::int64_t longest_samples_;
    StartUp start_up_;

    // Shared.
    CommandQueue<LiveCommand> commands_;
    CommandQueue<PlayedNote> played_;
    CommandQueue<BlockTiming> timings_;
    std::vector<float> ring_;  // sample n lies at n mod kRingSamples, both channels
    std::atomic<std::int64_t> rendered_{0}, handed_over_{0};  // samples
    std::exception_ptr sink_failure_;                         // the taker's; the caller's after its end
    std::atomic<State> state_{State::waiting};
    std::int64_t epoch_ns_ = 0;                            // written before `running`
    std::int64_t minimum_samples_ = 0, tail_samples_ = 0;  // written before `finishing`
    std::atomic<std::int64_t> fixed_sample_{0};
    std::atomic<bool> failed_{false};
    std::atomic<std::uint64_t> overflows_{0}, refused_{0}, blocks_done_{0}, blocks_late_{0};
    std::atomic<double> busy_s_{0};
    std::promise<StartUp> prepared_;
    std::promise<std::int64_t> kept_samples_;

    // The audio thread's.
    std::optional<Renderer> renderer_;
    LiveNotes notes_;
    std::vector<TakenNote> taken_;
    std::vector<float> block_;        // the newest
    std::vector<float> device_ring_;  // limited, sample n at n mod kDeviceRingSamples; empty: no device
    Limiter limiter_;
    std::vector<std::unique_ptr<SoundDevice>> devices_;  // after device_ring_, which they read
    JackOutput* jack_ = nullptr;                         // of devices_
    double device_delay_s_ = 0;
    bool on_device_ = false;  // from its start to its stop
    double busy_begin_s_ = 0;

    std::thread thread_;
    std::jthread taker_;  // last: it ends first
};

}  // namespace audio
